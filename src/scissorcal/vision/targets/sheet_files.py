"""Write a target's sheet as PDF (vectors) and PNG (20 pixels per millimetre)."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import file_error
from scissorcal.files import replacing
from scissorcal.vision.targets.pdf import sheet_pdf
from scissorcal.vision.targets.sheet import Sheet

if TYPE_CHECKING:
    from PIL import Image

PIXELS_PER_MM = 20


def write_target(sheet: Sheet, folder: Path) -> tuple[Path, Path]:
    """Write target-<name>-<paper>.pdf and .png into ``folder``; both at true scale.

    The same sheet gives the same bytes every time. Raises InputError where the folder cannot be
    written.
    """
    stem = f"target-{sheet.name}-{sheet.paper}"
    contents = {folder / f"{stem}.pdf": sheet_pdf(sheet), folder / f"{stem}.png": sheet_png(sheet)}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, content in contents.items():
            with replacing(path) as part:
                part.write_bytes(content)
    except OSError as error:
        raise file_error(error, folder) or error from None
    pdf, png = contents
    return pdf, png


def sheet_png(sheet: Sheet) -> bytes:
    """Give a sheet as a grey PNG whose resolution is stated in it."""
    stream = io.BytesIO()
    inch = PIXELS_PER_MM * 25.4
    sheet_picture(sheet).save(stream, format="PNG", dpi=(inch, inch), compress_level=6)
    return stream.getvalue()


def sheet_picture(sheet: Sheet) -> "Image.Image":
    """Draw a sheet at `PIXELS_PER_MM`."""
    from PIL import Image, ImageDraw, ImageFont

    scale = PIXELS_PER_MM
    picture = Image.new("L", (round(sheet.width * scale), round(sheet.height * scale)), 255)
    draw = ImageDraw.Draw(picture)
    for shape in sheet.rectangles:
        left, top = round(shape.x * scale), round(shape.y * scale)
        right = round((shape.x + shape.width) * scale) - 1
        low = round((shape.y + shape.height) * scale) - 1
        draw.rectangle((left, top, right, low), fill=round(255 * shape.level))
    for words in sheet.words:
        font = ImageFont.load_default(words.size * scale)
        draw.text((words.x * scale, words.y * scale), words.text, fill=0, font=font, anchor="ls")
    return picture
