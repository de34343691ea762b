# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts are well-formed SVG whose marks stand where the numbers say."""

import xml.etree.ElementTree as ElementTree

from afterglow import chart

NAMES = {"svg": "http://www.w3.org/2000/svg"}


def test_lines_are_well_formed_and_in_order() -> None:
    line = chart.Line("a < b", [(1, 0.1), (10, 0.01), (100, 0.001), (5, float("nan")), (7, -1)], [0.01, 0.001, 0.002],
                      ["x & y"], 1)
    root = ElementTree.fromstring(chart.lines("title", [line, chart.Line("empty", [])], "s", "e"))
    points = root.find("svg:polyline", NAMES).get("points").split()  # type: ignore[union-attr]
    places = [tuple(map(float, p.split(","))) for p in points]
    assert len(places) == 3
    assert places[0][0] < places[1][0] < places[2][0] and places[0][1] < places[1][1] < places[2][1]
    assert abs((places[1][0] - places[0][0]) - (places[2][0] - places[1][0])) < 0.2
    assert any("a < b" in (t.text or "") for t in root.iter() if t.text)


def test_bars_grow_from_the_goal() -> None:
    rows = [("met", 2.0, 0.1, True), ("missed", 0.5, None, False), ("unknown", 0.0, None, None)]
    root = ElementTree.fromstring(chart.bars("figures", rows))
    bars = [r for r in root.iterfind("svg:rect", NAMES) if r.get("height") == "18"]
    goal = [float(b.get("x")) for b in bars]
    width = [float(b.get("width")) for b in bars]
    assert abs(goal[0] - (goal[1] + width[1])) < 0.2 and width[0] > 10


def test_axis_ticks() -> None:
    assert chart.Axis(0.5, 20, 0, 1).ticks == [0.5, 1, 2, 5, 10, 20]
    assert chart.Axis(0, 60, 0, 1, log=False).ticks == [0, 10, 20, 30, 40, 50, 60]
    assert chart.number(0.00001) == "1.0e-05" and chart.number(1234.5) == "1234"


def test_table_lines_up() -> None:
    text = chart.table([("a", "bb"), ("long", "c")])
    assert text.splitlines() == ["a     bb", "----  --", "long  c"]


def test_labels_cover_nothing() -> None:
    points = [(10.0 * i, 0.0) for i in range(6)]
    labels = chart.Labels(points, 4)
    places = [labels.place(x, y, 30, 10) for x, y in points]
    kept = [p for p in places if p is not None]
    assert 2 <= len(kept) < len(points), "some find a place above or below, the crowd leaves none to all"
    for i, (x, y) in enumerate(kept):
        assert all(abs(x - px) >= 15 + 4 or abs(y - py) >= 5 + 4 for px, py in points)
        assert all(abs(x - a) >= 30 or abs(y - b) >= 10 for a, b in kept[:i])
