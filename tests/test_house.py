"""The house's rules that no linter knows: which way imports run, and that modules stay small."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TOPS = ("mjx_hand", "envs", "train", "tools")
MODULES = sorted(p for top in TOPS for p in (ROOT / top).rglob("*.py"))
MAX_LINES = 300
MAX_FILES = 20  # of a folder

# From the top floor down. A module stands on the floor of its longest name here, and imports from lower floors or
# its own room; rooms that share a floor do not know each other.
FLOORS = (
    ("tools",),
    ("train",),
    ("envs",),
    ("mjx_hand.__main__",),
    ("mjx_hand.cli",),
    ("mjx_hand.view",),
    ("mjx_hand.bodies",),
    ("mjx_hand.retarget", "mjx_hand.robots"),
    ("mjx_hand.capture", "mjx_hand.projection"),
    ("mjx_hand.rigid",),
    ("mjx_hand.hand",),
    ("mjx_hand.motion",),
    ("mjx_hand.objects",),
    ("mjx_hand.player",),
    ("mjx_hand.hand.joints",),  # the order of all arrays
    ("mjx_hand.files",),
    (
        "mjx_hand.rotations",
        "mjx_hand.pytree",
        "mjx_hand.compile_cache",
        "mjx_hand.progress",
        "mjx_hand.plugins",
        "mjx_hand.smoothstep",
    ),
    ("mjx_hand.errors", "mjx_hand.lazy_exports"),
)
# Re-export the public names, so they open on every room of their package and no module goes through them.
FRONT_DOORS = ("mjx_hand", "envs", "train")


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def is_module(name: str) -> bool:
    path = ROOT / Path(*name.split("."))
    return path.is_dir() or path.with_suffix(".py").is_file()


def imports(path: Path) -> Iterator[str]:
    """Full names of this project's modules that a module imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] in TOPS)
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in TOPS:
            modules = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if is_module(name) else node.module for name in modules)


def place(name: str) -> tuple[int, str]:
    """The floor, counted from the top, and the room of a module."""
    rooms = [
        (len(room), k, room) for k, floor in enumerate(FLOORS) for room in floor if f"{name}.".startswith(f"{room}.")
    ]
    assert rooms, f"{name} has no place in FLOORS"
    _, floor, room = max(rooms)
    return floor, room


def test_imports_run_downwards():
    wrong = []
    for path in MODULES:
        name = module_name(path)
        if name in FRONT_DOORS:
            continue
        floor, room = place(name)
        for imported in set(imports(path)):
            if imported in FRONT_DOORS:
                wrong.append(f"{name} imports through {imported}, which opens on everything: name the module")
                continue
            to_floor, to_room = place(imported)
            if not (to_floor > floor or to_room == room):
                wrong.append(f"{name} imports {imported}, which does not stand below it")
    assert not wrong, "\n".join(sorted(wrong))


def test_modules_stay_small():
    lines = {module_name(path): len(path.read_text().splitlines()) for path in MODULES}
    long = {name: count for name, count in lines.items() if count > MAX_LINES}
    assert not long, f"over {MAX_LINES} lines, split at the seam: {long}"


def folder_of(path: Path) -> str:
    """The folder of a module; a `__main__`, which opens on all of a package, is a door of its own."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts if parts[-1] == "__main__" else parts[:-1])


def test_folders_do_not_import_each_other_in_a_circle():
    folders = {module_name(path): folder_of(path) for path in MODULES}
    below: dict[str, set[str]] = {folder: set() for folder in folders.values()}
    for path in MODULES:
        if module_name(path) not in FRONT_DOORS:
            below[folder_of(path)] |= {folders[name] for name in imports(path) if name in folders} - {folder_of(path)}
    while bottom := {folder for folder, others in below.items() if not others}:
        below = {folder: others - bottom for folder, others in below.items() if folder not in bottom}
    assert not below, f"in a circle, or above one: {below}"


def test_folders_stay_small():
    count = Counter(map(folder_of, MODULES))
    crowded = {folder: files for folder, files in count.items() if files > MAX_FILES}
    assert not crowded, f"over {MAX_FILES} files, split by concept: {crowded}"


def test_no_import_is_relative():
    relative = [
        module_name(path)
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom) and node.level
    ]
    assert not relative, f"write full names: {relative}"


def test_a_name_is_read_as_its_own_room_and_not_as_one_that_begins_alike():
    assert place("mjx_hand.hand.joints")[0] > place("mjx_hand.motion.motion")[0] > place("mjx_hand.hand.model")[0]
    assert place("mjx_hand.rigid.rigid_hand")[1] == "mjx_hand.rigid"
