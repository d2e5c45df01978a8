import numpy as np

from mjx_hand.rigid.segmentation.borders import border_loops, cap_outlines


def test_border_loops_split_where_they_touch():
    # Two triangles that share only vertex 0: one boundary that passes it twice.
    loops = border_loops(np.array([[0, 1, 2], [0, 3, 4]]))
    assert sorted(sorted(loop.tolist()) for loop in loops) == [[0, 1, 2], [0, 3, 4]]


def test_outlines_pair_up_across_a_finger_base():
    # A loop that borders segment 7 on the back and on the palm of the hand, with 8 and 9 to either side.
    outlines = cap_outlines(list(range(8)), [7, 7, 8, 8, 7, 7, 9, 9], set())
    assert sorted(sorted(outline.tolist()) for outline in outlines) == [[0, 1, 2, 4, 5, 6], [0, 6, 7], [2, 3, 4]]


def test_a_chord_that_would_double_a_skin_edge_is_not_drawn():
    outlines = cap_outlines(list(range(4)), [7, 7, 8, 8], {(0, 2)})
    assert [sorted(outline.tolist()) for outline in outlines] == [[0, 1, 2, 3]]
