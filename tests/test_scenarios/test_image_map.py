"""Plain images as maps."""

import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from scenarios.errors import InputError
from scenarios.formats import image_map as image_map_module
from scenarios.formats import load_image_map


def saved(path, array, **options):
    Image.fromarray(np.array(array, np.uint8)).save(path, **options)
    return path


def png(path, bits, colour_type, pixels, width=1, height=1):
    """A PNG written by hand, for layouts that Pillow does not write."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, bits, colour_type, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" + pixels))
                     + chunk(b"IEND", b""))
    return path


def refusal(path, **options):
    with pytest.raises(InputError) as caught:
        load_image_map(path, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message.split("; ")) >= 3, "found; rule; remedy"
    return message


@pytest.mark.parametrize("name", ["m.png", "m.pgm", "m.bmp", "m.tif"])
def test_dark_is_occupied_from_127_down_and_rows_are_turned_over(tmp_path, name):
    read = load_image_map(saved(tmp_path / name, [[0, 127, 128], [255, 200, 50]]), resolution=0.05)
    np.testing.assert_array_equal(read.occupied, [[False, False, True], [True, True, False]])
    assert not read.unknown.any()
    assert (read.resolution, read.origin, read.yaw, read.y_down) == (0.05, (0.0, 0.0), 0.0, False)


def test_colours_count_by_the_mean_of_their_channels(tmp_path):
    # 255 + 126 + 0 = 381 = 3·127: occupied; one more is lighter than the middle.
    read = load_image_map(saved(tmp_path / "m.png", [[[255, 126, 0], [255, 128, 0]]]))
    np.testing.assert_array_equal(read.occupied, [[True, False]])


def test_black_and_white_and_palette_images_are_read(tmp_path):
    grey = Image.fromarray(np.array([[0, 255]], np.uint8))
    grey.convert("1").save(tmp_path / "bits.png")
    grey.convert("RGB").quantize(2).save(tmp_path / "palette.png")
    for name in ("bits.png", "palette.png"):
        np.testing.assert_array_equal(load_image_map(tmp_path / name).occupied, [[True, False]])


def test_an_opaque_alpha_channel_is_accepted(tmp_path):
    read = load_image_map(saved(tmp_path / "m.png", [[[0, 0, 0, 255], [255, 255, 255, 255]]]))
    np.testing.assert_array_equal(read.occupied, [[True, False]])


def test_transparent_pixels_are_refused(tmp_path):
    path = saved(tmp_path / "m.png", [[[0, 0, 0, 255], [255, 255, 255, 254]]])
    message = refusal(path)
    assert message.startswith(f"{path}: 1 transparent pixels (alpha below 255); ")
    assert "flatten the image" in message


def test_a_transparent_colour_is_refused_too(tmp_path):
    assert "2 transparent pixels" in refusal(saved(tmp_path / "m.png", [[0, 0, 255]], transparency=0))


def test_more_than_8_bits_a_channel_is_refused_in_every_layout(tmp_path):
    png(tmp_path / "grey.png", 16, 0, b"\0\1")
    png(tmp_path / "rgb.png", 16, 2, b"\0\1" * 3)
    png(tmp_path / "grey_alpha.png", 16, 4, b"\xff\xff" * 2)
    png(tmp_path / "rgba.png", 16, 6, b"\xff\xff" * 4)
    Image.fromarray(np.array([[7]], np.uint16)).save(tmp_path / "grey.tif")
    Image.fromarray(np.array([[0.5]], np.float32)).save(tmp_path / "float.tif")
    (tmp_path / "grey.pgm").write_bytes(b"P5 1 1 65535\n\0\1")
    (tmp_path / "rgb.ppm").write_bytes(b"P6 1 1 65535\n" + b"\0\1" * 3)
    paths = sorted(tmp_path.iterdir())
    assert len(paths) == 8
    for path in paths:
        message = refusal(path)
        assert message.startswith(f"{path}: more than 8 bits a channel"), path
        assert message.endswith("convert it to 8-bit grey")


def test_16_bits_for_a_whole_pixel_are_not_taken_for_16_a_channel(tmp_path):
    header = struct.pack("<IiiHHIIiiII", 40, 1, 1, 1, 16, 0, 4, 0, 0, 0, 0)
    (tmp_path / "m.bmp").write_bytes(b"BM" + struct.pack("<IHHI", 58, 0, 0, 54) + header + b"\xff\x7f\0\0")
    assert not load_image_map(tmp_path / "m.bmp").occupied.any()


@pytest.mark.parametrize("content", [b"no picture at all", b"P5 0 0 255\n", b"P5 20 10 255\n\0\0", b"\x89PNG\r\n\x1a\n",
                                     b"P5 x y 255\n"])
def test_a_broken_image_is_refused(tmp_path, content):
    path = tmp_path / "m.pgm"
    path.write_bytes(content)
    assert refusal(path).startswith(f"{path}: cannot be read as an image (")


def test_missing_empty_and_folder_are_refused(tmp_path):
    (tmp_path / "empty.png").touch()
    assert "no such file" in refusal(tmp_path / "none.png")
    assert "0 bytes" in refusal(tmp_path / "empty.png")
    assert "is a folder" in refusal(tmp_path)


def test_a_huge_image_is_refused_from_its_header(tmp_path):
    path = png(tmp_path / "huge.png", 8, 0, b"", width=20_000, height=10_000)
    assert refusal(path).startswith(f"{path}: ")
    assert "at most 67108864 pixels" in refusal(path)
    path = png(tmp_path / "large.png", 8, 0, b"", width=9_000, height=9_000)
    assert "9000 x 9000 pixels" in refusal(path)


def test_the_largest_size_is_still_accepted(tmp_path, monkeypatch):
    monkeypatch.setattr(image_map_module, "LARGEST_CELLS", 6)
    assert load_image_map(saved(tmp_path / "m.png", np.full((2, 3), 255))).occupied.shape == (2, 3)
    assert "7 x 1 pixels" in refusal(saved(tmp_path / "n.png", np.full((1, 7), 255)))


@pytest.mark.parametrize("resolution", [0, -0.1, float("nan"), float("inf"), "wide", None, True])
def test_a_resolution_that_is_no_length_is_refused(tmp_path, resolution):
    message = refusal(saved(tmp_path / "m.png", [[255]]), resolution=resolution)
    assert message.startswith(f"resolution: {resolution!r}; must be a finite number above 0")
