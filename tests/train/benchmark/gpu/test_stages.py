import pytest

from mjx_hand.errors import InputError
from train.benchmark.gpu.budget import Budget
from train.benchmark.gpu.stages import Stage, run_stages


class Clock:
    """Time that passes when it is told to."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class Kept:
    """Remembers how each stage stood, and how many rows it had, whenever records were kept."""

    def __init__(self):
        self.seen, self.traces = [], []

    def __call__(self, records, trace=None):
        self.seen.append([(record.status, sum(len(t.rows) for t in record.tables)) for record in records])
        if trace is not None:
            self.traces.append(trace)


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def kept():
    return Kept()


def lasting(clock, seconds, points=1):
    """A stage's work: so many points of equal length, each of them kept."""

    def run(record, keep):
        table = record.table("point")
        for k in range(points):
            clock.now += seconds / points
            table.add(k)
            keep()

    return run


def test_stages_that_do_not_fit_are_skipped_and_later_ones_that_do_are_run(clock, kept):
    said = []
    stages = [
        Stage("long", "first", 50.0, lasting(clock, 40)),
        Stage("longer", "second", 30.0, lasting(clock, 30)),
        Stage("short", "third", 20.0, lasting(clock, 5)),
    ]
    records = run_stages(stages, Budget.of(1.0, clock), kept, said.append)
    assert [record.status for record in records] == ["done", "skipped", "done"]
    assert records[1].reason == "needs about 30 s, 20 s were left"
    assert [record.seconds for record in records] == [40, 0, 5]
    assert "longer: skipped, needs about 30 s, 20 s were left" in said


def test_points_are_kept_as_they_come_and_stages_as_they_begin_and_end(clock, kept):
    stages = [Stage("a", "first", 1.0, lasting(clock, 4, points=2)), Stage("b", "second", 1.0, lasting(clock, 1))]
    run_stages(stages, Budget.of(1.0, clock), kept, lambda text: None)
    waiting = ("not reached", 0)
    assert kept.seen == [
        [("under way", 0), waiting],
        [("under way", 1), waiting],
        [("under way", 2), waiting],
        [("done", 2), waiting],
        [("done", 2), ("under way", 0)],
        [("done", 2), ("under way", 1)],
        [("done", 2), ("done", 1)],
    ]


def test_a_stage_that_fails_is_told_in_one_line_and_does_not_stop_the_others(clock, kept):
    def failing(record, keep):
        record.table("point").add(1)
        raise RuntimeError("no\nluck " + 1000 * "x")

    def refusing(record, keep):
        raise InputError("not installed; install it")

    stages = [
        Stage("bad", "first", 1.0, failing),
        Stage("none", "second", 1.0, refusing),
        Stage("good", "third", 1.0, lasting(clock, 1)),
    ]
    bad, none, good = run_stages(stages, Budget.of(1.0, clock), kept, lambda text: None)
    assert [bad.status, none.status, good.status] == ["failed", "failed", "done"]
    assert bad.reason.startswith("RuntimeError: no luck xxx")
    assert len(bad.reason) < 320
    assert none.reason == "not installed; install it"
    assert [name for name, _ in kept.traces] == ["bad", "none"]
    assert "in failing" in kept.traces[0][1]
    assert bad.tables[0].rows == [(1,)]


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit(143)])
def test_an_interruption_keeps_what_there_is_and_ends_it_all(clock, kept, error):
    def interrupted(record, keep):
        record.table("point").add(1)
        raise error

    stages = [Stage("a", "first", 1.0, lasting(clock, 1)), Stage("b", "second", 1.0, interrupted)]
    stages.append(Stage("c", "third", 1.0, lasting(clock, 1)))
    with pytest.raises(type(error) if isinstance(error, BaseException) else error):
        run_stages(stages, Budget.of(1.0, clock), kept, lambda text: None)
    assert kept.seen[-1] == [("done", 1), ("interrupted", 1), ("not reached", 0)]


def test_a_stage_that_left_points_out_is_cut_short(clock, kept):
    def run(record, keep):
        record.left_out.append("4 worlds")

    (record,) = run_stages([Stage("a", "first", 1.0, run)], Budget.of(1.0, clock), kept, lambda text: None)
    assert record.status == "cut short"


def test_a_budget_is_never_less_than_nothing(clock):
    budget = Budget.of(0.5, clock)
    assert budget.left() == 30
    assert budget.fits(30.0)
    assert not budget.fits(30.1)
    clock.now += 31
    assert budget.left() == 0
