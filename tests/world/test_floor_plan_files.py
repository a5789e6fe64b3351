import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal

from drake_mobarm.exceptions import MapError, OutputError
from drake_mobarm.world import (
    FloorPlan,
    floor_plan_of,
    load_world,
    read_floor_plan,
    write_floor_plan,
)
from drake_mobarm.world.world import WORLDS

# By hand: 255 is p = 0, 0 is p = 1, and 205 is p = 50/255 = 0.19608.
FIELDS = {
    "image": "map.pgm",
    "resolution": "0.05",
    "origin": "[-1.5, 2.25, 0.5]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}
PGM = b"P5\n4 2\n255\n" + bytes([0, 205, 254, 255, 255, 254, 205, 0])

# Colour types of PNG.
GREY, RGB, PALETTE, GREY_ALPHA, RGBA = 0, 2, 3, 4, 6


def png(color, rows, depth=8, **chunks):
    """A PNG of rows of bytes; other chunks stand before the pixels."""

    def chunk(kind, data):
        check = zlib.crc32(kind + data)
        return (
            struct.pack(">I", len(data))
            + kind
            + data
            + struct.pack(">I", check)
        )

    channels = {GREY: 1, RGB: 3, PALETTE: 1, GREY_ALPHA: 2, RGBA: 4}[color]
    width = len(rows[0]) * 8 // depth // channels
    head = struct.pack(">IIBBBBB", width, len(rows), depth, color, 0, 0, 0)
    pixels = b"".join(b"\0" + bytes(row) for row in rows)
    return b"".join(
        [
            b"\x89PNG\r\n\x1a\n",
            chunk(b"IHDR", head),
            *(chunk(k.encode(), bytes(data)) for k, data in chunks.items()),
            chunk(b"IDAT", zlib.compress(pixels)),
            chunk(b"IEND", b""),
        ]
    )


@pytest.fixture
def saved(tmp_path):
    """Writes a map's files; a field of None is left out."""

    def save(data=PGM, name="map.pgm", **changes):
        (tmp_path / name).write_bytes(data)
        fields = FIELDS | {"image": name} | changes
        (tmp_path / "map.yaml").write_text(
            "".join(
                f"{key}: {value}\n"
                for key, value in fields.items()
                if value is not None
            )
        )
        return tmp_path / "map.yaml"

    return save


def read(path):
    """A map's cells: `#` occupied, `.` free, `?` unknown."""
    plan = read_floor_plan(path)
    cells = np.full(plan.occupied.shape, "?")
    cells[plan.occupied] = "#"
    cells[plan.free] = "."
    return ["".join(row) for row in cells]


def test_black_is_occupied_white_free_and_205_unknown(saved):
    plan = read_floor_plan(saved())
    assert_array_equal(plan.occupied, np.array([[1, 0, 0, 0], [0, 0, 0, 1]]))
    assert_array_equal(plan.unknown, np.array([[0, 1, 0, 0], [0, 0, 1, 0]]))
    assert_array_equal(plan.free, np.array([[0, 0, 1, 1], [1, 1, 0, 0]]))
    assert plan.resolution == 0.05
    assert plan.origin == (-1.5, 2.25, 0.5)


def test_a_plain_pgm_may_have_comments(saved):
    image = (
        b"P2 # plain\n# of two rows\n2 2\n255 # white\n0 205\n254 # . \n255\n"
    )
    assert read(saved(image)) == ["#?", ".."]


def test_sixteen_bits_are_a_shade_of_65535(saved):
    # p of 0x5999 is 0.650004 and of 0x5998 0.650019; of 0x59 it is 0.651.
    image = b"P5\n4 1\n65535\n" + bytes.fromhex("0000 5999 5998 ffff")
    assert read(saved(image, occupied_thresh="0.65001")) == ["#?#."]
    image = b"P2\n3 1\n65535\n0 30000 65535\n"
    assert read(saved(image)) == ["#?."]
    image = png(GREY, [bytes.fromhex("0000 8000 ffff")], depth=16)
    assert read(saved(image, "map.png")) == ["#?."]


def test_shades_are_shares_of_the_largest_value(saved):
    image = b"P5\n3 1\n100\n" + bytes([0, 50, 100])
    assert read(saved(image)) == ["#?."]


def test_a_cell_on_a_threshold_is_unknown(saved):
    # With negate, p of 51 is 51/255 = 0.2, and of 204 it is 0.8.
    image = b"P5\n4 1\n255\n" + bytes([50, 51, 204, 205])
    fields = {"occupied_thresh": "0.8", "free_thresh": "0.2", "negate": "1"}
    assert read(saved(image, **fields)) == [".??#"]


@pytest.mark.parametrize("negate", ["1", "true", "True", "yes"])
def test_negated_white_is_occupied(saved, negate):
    # p is s: 205/255 = 0.80 is over 0.65.
    assert read(saved(negate=negate)) == [".###", "###."]


def test_colours_are_averaged(saved):
    # Means 85, 170 and 255: p is 0.667, 0.333 and 0.
    row = [255, 0, 0, 255, 255, 0, 255, 255, 255]
    assert read(saved(png(RGB, [row]), "map.png")) == ["#?."]


def test_a_palette_is_of_colours(saved):
    image = png(PALETTE, [[2, 1, 0]], PLTE=[255] * 3 + [128] * 3 + [0] * 3)
    assert read(saved(image, "map.png")) == ["#?."]


def test_one_bit_is_black_or_white(saved):
    image = png(GREY, [[0b01100000]], depth=1)
    assert read(saved(image, "map.png")) == ["#..#####"]
    # In a PBM, 1 is black.
    assert read(saved(b"P1\n3 1\n1 0 1\n", "map.pbm")) == ["#.#"]


def test_in_trinary_alpha_is_averaged_with_three_shades(saved):
    # s is (3 * 0 + 1) / 4 = 0.25, p = 0.75: ROS 1 has 0.5. Clear black has
    # p = 1, opaque white 0, and clear white 0.25.
    row = [0, 255, 0, 0, 255, 255, 255, 0]
    assert read(saved(png(GREY_ALPHA, [row]), "map.png")) == ["##.?"]
    row = [0, 0, 0, 255, 0, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 0]
    assert read(saved(png(RGBA, [row]), "map.png")) == ["##.?"]


def test_a_palettes_transparency_is_alpha(saved):
    image = png(PALETTE, [[0, 1]], PLTE=[0] * 3 + [255] * 3, tRNS=[255, 0])
    fields = {"mode": "scale"}
    with pytest.raises(MapError, match="no cell is free"):
        read(saved(image, "map.png", **fields))
    image = png(PALETTE, [[0, 1]], PLTE=[0] * 3 + [255] * 3, tRNS=[0, 255])
    assert read(saved(image, "map.png", **fields)) == ["?."]


def test_in_scale_what_is_not_opaque_is_unknown(saved):
    # Opaque, 80 is p = 0.69; with alpha averaged in, it would be 0.51.
    row = [80, 255, 0, 254, 0, 0, 128, 255, 255, 255, 255, 254]
    image = png(GREY_ALPHA, [row])
    assert read(saved(image, "map.png", mode="scale")) == ["#???.?"]


def test_in_scale_negate_holds(saved):
    assert read(saved(mode="scale", negate="1")) == [".###", "###."]


def test_in_raw_the_shade_is_a_percentage(saved):
    image = b"P5\n8 1\n255\n" + bytes([0, 19, 20, 65, 66, 100, 101, 255])
    for negate in "01":
        path = saved(image, mode="raw", negate=negate)
        assert read(path) == ["..??##??"]


def test_in_raw_0_is_free_and_100_occupied_whatever_the_thresholds(saved):
    image = b"P5\n3 1\n255\n" + bytes([0, 50, 100])
    fields = {"free_thresh": "0", "occupied_thresh": "1"}
    assert read(saved(image, mode="raw", **fields)) == [".?#"]


def test_in_raw_alpha_is_not_looked_at(saved):
    image = png(GREY_ALPHA, [[100, 0, 0, 0, 255, 255]])
    assert read(saved(image, "map.png", mode="raw")) == ["#.?"]


def test_an_absolute_path_of_an_image_holds(saved, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    file = tmp_path / "elsewhere" / "plan.pgm"
    file.write_bytes(b"P5\n2 1\n255\n\x00\xff")
    path = saved()
    path.write_text(path.read_text().replace("map.pgm", str(file)))
    assert read(path) == ["#."]


def test_a_relative_path_of_an_image_is_from_the_yaml(saved, monkeypatch):
    path = saved()
    (path.parent / "images").mkdir()
    (path.parent / "map.pgm").rename(path.parent / "images" / "a b.pgm")
    path.write_text(path.read_text().replace("map.pgm", "images/a b.pgm"))
    monkeypatch.chdir(path.parent.parent)
    assert read(f"{path.parent.name}/map.yaml") == ["#?..", "..?#"]


def test_a_tilde_is_the_home_folder(saved, monkeypatch):
    monkeypatch.setenv("HOME", str(saved().parent))
    assert read("~/map.yaml") == ["#?..", "..?#"]


def test_numbers_are_as_yaml_1_2_has_them(saved):
    plan = read_floor_plan(saved(resolution="5e-2", origin="[1, -2, +.5]"))
    assert (plan.resolution, plan.origin) == (0.05, (1.0, -2.0, 0.5))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"resolution": None}, "resolution is missing"),
        ({"resolution": ""}, "resolution is missing"),
        ({"resolution": "0"}, "resolution is 0.0: valid"),
        ({"resolution": "-0.05"}, "resolution is -0.05: valid"),
        ({"resolution": ".nan"}, "resolution is '.nan': valid is a number"),
        ({"resolution": "nan"}, "resolution is nan: valid"),
        ({"resolution": "5 cm"}, "resolution is '5 cm': valid is a number"),
        ({"resolution": "[0.05]"}, "resolution is ['0.05']: valid is a number"),
        ({"origin": None}, "origin is missing"),
        ({"origin": "[0, 0]"}, "origin is ['0', '0']: valid is [x, y, yaw]"),
        ({"origin": "0"}, "origin is '0': valid is [x, y, yaw]"),
        ({"origin": "[0, 0, north]"}, "origin is 'north': valid is a number"),
        ({"origin": "[0, inf, 0]"}, "origin is (0.0, inf, 0.0): valid"),
        ({"image": None}, "image is missing"),
        ({"image": "[a, b]"}, "image is ['a', 'b']: valid is an image's path"),
        ({"image": "no.pgm"}, "no.pgm cannot be read: No such file"),
        ({"image": "."}, "cannot be read: Is a directory"),
        ({"image": "map.yaml"}, "map.yaml is no PGM, PNG or BMP"),
        ({"mode": "binary"}, "mode is 'binary': valid is trinary, scale, raw"),
        ({"mode": ""}, "mode is '': valid is trinary, scale, raw"),
        ({"mode": "[raw]"}, "mode is ['raw']: valid is trinary, scale, raw"),
        ({"negate": None}, "negate is missing"),
        ({"negate": "maybe"}, "negate is 'maybe': valid is 0, 1, true, false"),
        ({"free_thresh": None}, "free_thresh is missing"),
        ({"occupied_thresh": "high"}, "occupied_thresh is 'high': valid"),
        ({"occupied_thresh": "1.5"}, "and occupied_thresh 1.5: valid is 0 <="),
        ({"free_thresh": "0.65"}, "free_thresh is 0.65 and occupied_thresh"),
        ({"free_thresh": "nan"}, "free_thresh is nan and"),
    ],
)
def test_a_wrong_field_is_named_in_one_line(saved, changes, said):
    path = saved(**changes)
    with pytest.raises(MapError) as raised:
        read_floor_plan(path)
    assert str(raised.value).startswith(f"map {path}: ")
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("image", "said"),
    [
        (b"", "is no PGM, PNG or BMP, or it is damaged or empty"),
        (b"P5\n0 0\n255\n", "is no PGM, PNG or BMP, or it is damaged or empty"),
        (PGM[:-1], "cannot be read: image file is truncated"),
        (b"P2\n2 1\n255\n0 x\n", "cannot be read: "),
        (b"P5\n5001 5000\n255\n\0", "too large: valid are up to 25000000 pix"),
        (b"P5\n10000 10000\n255\n\0", "is too large"),
        (b"P5\n99999 99999\n255\n\0", "is too large"),
        (b"Pf\n1 1\n-1.0\n\0\0\0\0", "has shades without a limit"),
        (b"P5\n2 1\n255\n\xcd\xcd", "no cell is free, 0 are occupied, 2 unk"),
        (b"P5\n2 1\n255\n\0\0", "no cell is free, 2 are occupied, 0 unk"),
    ],
)
def test_an_image_that_is_no_map_is_told_in_one_line(saved, image, said):
    path = saved(image)
    with pytest.raises(MapError) as raised:
        read_floor_plan(path)
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"", "holds no keys"),
        (b"- a\n- b\n", "holds no keys"),
        (b"a: [1\nb: 2\n", "is no YAML: "),
        (b"\xff\xfe\xfa", "is no YAML"),
        (b"[" * 5000, "is no YAML"),
    ],
)
def test_what_is_no_yaml_is_told(tmp_path, text, said):
    path = tmp_path / "map.yaml"
    path.write_bytes(text)
    with pytest.raises(MapError, match=said):
        read_floor_plan(path)


def test_a_missing_map_is_told(tmp_path):
    with pytest.raises(MapError, match=r"no.yaml: cannot be read: No such"):
        read_floor_plan(tmp_path / "no.yaml")


@st.composite
def plans(draw):
    shape = draw(st.tuples(st.integers(1, 7), st.integers(1, 7)))
    kinds = draw(arrays(np.uint8, shape, elements=st.integers(0, 2)))
    kinds[0, -1] = 0
    number = st.floats(-1e6, 1e6)
    return FloorPlan(
        kinds == 1,
        kinds == 2,
        draw(st.floats(1e-4, 1e3)),
        draw(st.tuples(number, number, number)),
    )


@given(plan=plans(), image_format=st.sampled_from(["png", "pgm"]))
def test_what_is_written_is_read(plan, image_format, tmp_path_factory):
    path = tmp_path_factory.mktemp("maps") / "a: map.yaml"
    write_floor_plan(plan, path, image_format)
    found = read_floor_plan(path)
    assert_array_equal(found.occupied, plan.occupied)
    assert_array_equal(found.unknown, plan.unknown)
    assert found.resolution == plan.resolution
    assert found.origin == plan.origin


def test_pixels_are_written_as_ros_does(tmp_path):
    plan = FloorPlan(np.array([[True, False, False]]), np.eye(1, 3, 1) > 0, 0.1)
    write_floor_plan(plan, tmp_path / "plan.yml", "pgm")
    image = (tmp_path / "plan.pgm").read_bytes()
    assert image == b"P5\n3 1\n255\n" + bytes([0, 205, 254])
    assert (tmp_path / "plan.yml").read_text().splitlines() == [
        "image: plan.pgm",
        "mode: trinary",
        "resolution: 0.1",
        "origin: [0.0, 0.0, 0.0]",
        "negate: 0",
        "occupied_thresh: 0.65",
        "free_thresh: 0.196",
    ]


def test_where_a_map_cannot_be_written_it_is_told(tmp_path):
    plan = FloorPlan(np.zeros((1, 1), bool), np.zeros((1, 1), bool), 0.1)
    with pytest.raises(OutputError, match=r"valid is a .yaml or .yml file"):
        write_floor_plan(plan, tmp_path / "map.png")
    with pytest.raises(OutputError, match=r"cannot be written: No such file"):
        write_floor_plan(plan, tmp_path / "no" / "map.yaml")
    with pytest.raises(MapError, match="image_format is 'jpg': valid is png"):
        write_floor_plan(plan, tmp_path / "map.yaml", "jpg")


def test_a_shipped_world_has_a_plan_that_differs_from_it():
    world = load_world("cafe")
    given, true = floor_plan_of(world), FloorPlan.from_world(world)
    corner = [[0.05, -2.0]]  # Of a table's top, 0.4 m from its foot.
    assert given.occupied[given.index(corner)].all()
    assert not true.occupied[true.index(corner)].any()


def test_the_path_of_a_shipped_world_leads_to_its_plan():
    by_path = floor_plan_of(load_world(str(WORLDS / "cafe.sdf")))
    by_name = floor_plan_of(load_world("cafe"))
    assert_array_equal(by_path.occupied, by_name.occupied)


def test_a_copy_of_a_shipped_world_has_its_true_plan(tmp_path):
    file = tmp_path / "cafe.sdf"
    file.write_text((WORLDS / "cafe.sdf").read_text())
    (tmp_path / "cafe.yaml").write_text("world: cafe.sdf\n")
    world = load_world(str(file))
    given, true = floor_plan_of(world), FloorPlan.from_world(world)
    assert_array_equal(given.occupied, true.occupied)


def test_the_plan_of_an_empty_world_reaches_beyond_what_it_has_to_cover():
    plan = floor_plan_of(load_world("empty"), cover=[[0.0, 0.0], [30.0, 2.0]])
    assert plan.free.all()
    assert plan.free[plan.index([[30.9, 2.9]])].all()
