"""Plain images as maps, and the pixels of any image that Pillow reads."""

import re
import warnings
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from scenarios.errors import InputError
from scenarios.formats.map_file import MapFile
from scenarios.formats.reading import bad_input, positive_number, read_bytes

IMAGE_SUFFIXES = (".png", ".pgm", ".ppm", ".pbm", ".pnm", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff",
                  ".webp")
LARGEST_CELLS = 8192 * 8192
FINEST, COARSEST = 0.001, 100.0  # [m], side of a pixel

_DEEP_LAYOUT = re.compile(r"(L|LA|RGB|RGBA|RGBX|I);16")


@dataclass(frozen=True, eq=False)
class Pixels:
    """An image of 8 bits a channel, rows from the top; [h, w] are its rows and columns.

    Several colour channels count by their mean. Kept as a sum, so that shares are the nearest float64 to the
    exact quotient and a pixel that lies on a threshold is found there.
    """

    total: np.ndarray  # [h, w] int32, sum of the colour channels, each 0..255
    channels: int  # how many were summed
    alpha: np.ndarray | None  # [h, w] uint8, 255 opaque; None: the image has no transparency

    def bright(self) -> np.ndarray:
        """[h, w] float64, mean / 255: 0 black, 1 white."""
        return self.total / (255 * self.channels)

    def dark(self) -> np.ndarray:
        """[h, w] float64, 1 - mean / 255: 0 white, 1 black."""
        return (255 * self.channels - self.total) / (255 * self.channels)


def load_image_map(path: str | Path, resolution: float = 1.0) -> MapFile:
    """Read a plain image as a map: a pixel is occupied where 1 - v/255 ≥ 0.5 (v ≤ 127), nothing is unknown.

    The lower-left corner of the picture is the origin (0, 0); `resolution` is the side of a pixel [m].
    Colours count by the mean of their channels. An alpha channel is accepted while every pixel is opaque:
    what lies under a transparent one is no statement about the world. Raises InputError for that, for images
    of more than 8 bits a channel (a grey of 16 bits often means a distance or a probability, so no scaling is
    guessed) and for files that Pillow cannot read.
    """
    positive_number("resolution", resolution, "give the side of a pixel in metres")
    if not FINEST <= resolution <= COARSEST:
        raise bad_input("resolution", f"{resolution:g}", f"must be from {FINEST:g} to {COARSEST:g} m",
                        "give the side of a pixel in metres")
    pixels = read_pixels(path)
    if pixels.alpha is not None and (pixels.alpha < 255).any():
        count = int((pixels.alpha < 255).sum())
        raise bad_input(path, f"{count} transparent pixels (alpha below 255)", "a plain image map is opaque",
                        "flatten the image, or name it in a ROS map YAML, where transparent means unknown")
    occupied = (pixels.dark() >= 0.5)[::-1].copy()
    return MapFile(name=str(path), occupied=occupied, unknown=np.zeros_like(occupied),
                   resolution=float(resolution), origin=(0.0, 0.0))


def read_pixels(path: str | Path) -> Pixels:
    """The pixels of an image, of its first frame where it has several.

    Raises InputError for a file that is missing or that Pillow cannot read, for more than 8 bits a channel,
    and for images without pixels or of more than 8192² of them.
    """
    content = read_bytes(path, "an image")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(BytesIO(content)) as image:
                _check_header(path, image)
                return _pixels_of(image)
    except InputError:
        raise
    except Image.DecompressionBombError:
        raise _too_large(path, "a decompression bomb by Pillow's count") from None
    except Exception as error:  # Pillow's decoders raise whatever they meet in a broken file
        reason = "no known format" if isinstance(error, UnidentifiedImageError) else str(error)
        raise bad_input(path, f"cannot be read as an image ({reason})",
                        "an image map is a picture that Pillow opens",
                        "check the file, or save it again as PNG or PGM") from None


def _pixels_of(image: Image.Image) -> Pixels:
    """Decode: one channel for grey images, three for coloured ones, and any alpha channel."""
    if image.has_transparency_data:
        array = np.asarray(image.convert("RGBA"))
        total = array[..., :3].sum(axis=2, dtype=np.int32)
        return Pixels(total=total, channels=3, alpha=array[..., 3].copy())
    if image.mode in ("1", "L"):
        return Pixels(total=np.asarray(image.convert("L")).astype(np.int32), channels=1, alpha=None)
    array = np.asarray(image.convert("RGB"))
    return Pixels(total=array.sum(axis=2, dtype=np.int32), channels=3, alpha=None)


def _check_header(path: str | Path, image: Image.Image) -> None:
    width, height = image.size
    if width < 1 or height < 1:
        raise bad_input(path, f"{width} x {height} pixels", "an image map has at least one",
                        "write the image again")
    if width * height > LARGEST_CELLS:
        raise _too_large(path, f"{width} x {height} pixels")
    layout = _deep_layout(image)
    if layout:
        raise bad_input(path, f"more than 8 bits a channel ({layout})", "an image map has 8 bits a channel",
                        "convert it to 8-bit grey")


def _deep_layout(image: Image.Image) -> str:
    """Pillow's name for a layout of more than 8 bits a channel, "" for any other.

    The mode alone does not tell: 16-bit colour opens as mode RGB and would be cut down to 8 bits in silence.
    """
    if image.mode.startswith(("I", "F")):
        return image.mode
    for tile in getattr(image, "tile", ()):
        arguments = tile[3] if isinstance(tile[3], tuple) else (tile[3],)
        for argument in arguments:
            if isinstance(argument, str) and _DEEP_LAYOUT.match(argument):
                return argument
            if image.format == "PPM" and isinstance(argument, int) and argument > 255:
                return f"largest value {argument}"
    return ""


def _too_large(path: str | Path, found: str) -> InputError:
    return bad_input(path, found, f"an image map has at most {LARGEST_CELLS} pixels",
                     "crop it or make it coarser")

