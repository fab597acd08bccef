"""Pages: what is escaped, what stands out, and that they need no other file."""

from depthwalk.quality.html import Figure, Section, render_page


def test_everything_is_escaped() -> None:
    section = Section(
        title="<title>",
        lines=["<line>"],
        tables=[[("<head>",), ("<cell>",)]],
        notes=["<note>"],
        figures=[Figure("<caption>", {'"<name>': b"png"})],
    )
    page = render_page("<page>", ["<headline>"], [section])
    for word in ("page", "headline", "title", "line", "head", "cell", "note", "caption", "name"):
        assert f"&lt;{word}&gt;" in page, word
    assert "<cell>" not in page and 'alt="&#34;&lt;name&gt;"' in page
    assert page.endswith("</body></html>\n") and "http" not in page


def test_missed_goals_stand_out() -> None:
    page = render_page("t", [], [Section(title="s", tables=[[("", "value"), ("a", "1.0 FAIL"), ("b", "2.0 ok")]])])
    assert page.count('class="missed"') == 1 and '<td class="missed">1.0 FAIL</td>' in page


def test_pictures_are_within_the_page() -> None:
    page = render_page("t", ["a", "b"], [Section(title="s", figures=[Figure("c", {"n": b"\x00\xff"})], colour="#123")])
    assert 'src="data:image/png;base64,AP8="' in page and "a<br>b" in page and 'style="color: #123"' in page
