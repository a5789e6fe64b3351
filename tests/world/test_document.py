"""XML that Gazebo and Drake read, and what is no XML for anyone."""

import pytest

from drake_mobarm.world.document import DocumentError, parse_document
from drake_mobarm.world.sdf import load_world
from helpers.sdf import collision, faults, line_of, model, saved, world

PLAIN = world(model(collision()))


def loads(folder, text):
    return [o.name for o in load_world(saved(folder, text)).obstacles]


@pytest.mark.parametrize(
    "text",
    [
        PLAIN.replace("<world", "<!-- one -- two --->\n<world"),
        PLAIN.replace("</world>", '<gz:gui gz:a="1"/>\n</world>'),
        "\n  \n" + PLAIN,
        "text before\n" + PLAIN,
        "\ufeff" + PLAIN,
        PLAIN.replace("</world>", "<plugin>a & b &nbsp; &x;</plugin></world>"),
        PLAIN.replace("</world>", '<plugin name="a&b"/></world>'),
        PLAIN.replace("<world", "<!-- \x01 -->\n<world"),
        PLAIN.replace(
            "</world>", "<plugin><![CDATA[<a> & <b>]]></plugin></world>"
        ),
        "<!DOCTYPE sdf>\n" + PLAIN,
        PLAIN.replace('"', "'"),
        PLAIN.replace("\n", "\r\n"),
    ],
    ids=[
        "two hyphens in a comment",
        "an undeclared prefix",
        "blank lines before the declaration",
        "text before the declaration",
        "a byte order mark",
        "bare ampersands",
        "a bare ampersand in an attribute",
        "a control character",
        "quoted text",
        "a document type",
        "single quotes",
        "lines of Windows",
    ],
)
def test_what_gazebo_reads_is_read(tmp_path, text):
    assert loads(tmp_path, text) == ["wall"]


def test_latin_1_is_read_where_a_file_is_not_utf_8(tmp_path):
    path = tmp_path / "mine.sdf"
    path.write_bytes(world(model(collision(name="café"))).encode("latin-1"))
    assert [o.name for o in load_world(str(path)).obstacles] == ["café"]
    path.write_bytes(world(model(collision(name="cafés"))).encode("utf-8"))
    assert [o.name for o in load_world(str(path)).obstacles] == ["cafés"]


@pytest.mark.parametrize(
    "before", ["\n\n", "<!-- one\n-- two\n -->", "<?one\ntwo?>", "junk\n"]
)
def test_lines_are_those_of_the_file_whatever_was_skipped(tmp_path, before):
    text = before + world(model(collision("<torus/>")))
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(f"line {line_of(text, '<collision')}: ")


@pytest.mark.parametrize(
    ("text", "reason", "line"),
    [
        ("<a>\n<b>\n</a>", "mismatched tag", "3 within <b> of line 2"),
        ("<a>\n<b/>\n", "no element found", "3 within <a> of line 1"),
        ("<a/>\n<b/>", "junk after document element", "2"),
        ('<a>\n<b c="1" c="2"/></a>', "duplicate attribute", "2 within <a>"),
        ("<a>\n<b c=1/></a>", "not well-formed", "2 within <a> of line 1"),
    ],
)
def test_what_is_no_xml_is_refused_with_its_line(text, reason, line):
    with pytest.raises(DocumentError) as caught:
        parse_document(text.encode())
    assert f"is not valid XML: {reason}" in str(caught.value)
    assert f"in line {line}" in str(caught.value)


@pytest.mark.parametrize("data", [b"", b"no XML", b"\xff\xfe<\0a\0", b"\0<a/>"])
def test_what_is_no_text_is_refused(data):
    with pytest.raises(DocumentError, match="is not valid XML"):
        parse_document(data)


def test_elements_within_3000_others_are_refused():
    text = "<a>\n" * 3000 + "</a>" * 3000
    with pytest.raises(DocumentError, match="100 elements deep in line 101"):
        parse_document(text.encode())


def test_entities_of_a_files_own_are_not_replaced():
    text = b'<!DOCTYPE a [<!ENTITY big "aaaa">]><a>&big;&big;&amp;</a>'
    assert parse_document(text).text == "&big;&big;&"


def test_an_element_knows_its_text_and_what_is_in_it():
    root = parse_document(b'<a>\n1 <b n="x">2</b>3<b>4</b><c><d>5</d></c></a>')
    assert (root.tag, root.text.strip(), root.line) == ("a", "1", 1)
    assert [child.text for child in root.all("b")] == ["2", "4"]
    assert root.find("c/d").text == "5"
    assert root.find("c/e") is None
    assert root.find("b").attributes == {"n": "x"}
    assert root.find("b").line == 2
    assert root.text_of("b") == "2"
    assert root.text_of("z") == ""
