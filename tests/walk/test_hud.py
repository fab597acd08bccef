from depthwalk.walk.hud import pass_rows


def test_passes_that_do_next_to_nothing_share_a_row():
    times = {"warp": 30.0, "composite": 69.0, "fxaa": 0.01, "smaa": 0.02, "dof": 0.4, "light": 0.57}
    assert pass_rows(times) == [("warp", "30.00"), ("composite", "69.00"), ("light", "0.57"), ("others", "0.43")]


def test_none_is_left_out_where_all_do_something():
    assert pass_rows({"warp": 3.0, "light": 1.0}) == [("warp", "3.00"), ("light", "1.00")]
    assert pass_rows({}) == []
