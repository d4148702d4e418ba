"""Record the README's moving picture: drive the Ant in tmux, press keys, and write what the terminal shows.

Run it from the top of the checkout. It needs tmux, gifsicle, Pillow and the DejaVu fonts:

    python .github/record_screen.py .github/screen.gif
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont
from rich.text import Text

COLUMNS, LINES = 110, 36
FONT = "/usr/share/fonts/truetype/dejavu/DejaVuSansMono{}.ttf"
FONT_SIZE = 14
FRAMES_PER_SECOND = 6
LEAD_IN, LENGTH = 4.0, 14.0
PRESSES = [(1.6, "a", "turn left"), (6.6, "v", "view from above"), (10.0, "x", "stop")]
"""Seconds into the picture, the key, and what the caption says of it."""
CAPTION_SECONDS = 2.0
BRAILLE_DOTS = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]
"""Column and row of each bit of a Braille letter."""
BACKGROUND, FOREGROUND, CAP = "#0c1016", "#cdd6e0", "#f0a45d"


def capture_frames() -> list[tuple[float, str, str]]:
    """Drive the Ant; return the time, the screen with its colors, and the caption of every frame."""
    drive = f"{sys.executable} -m pdtui drive ant --seed 7 --no-record"
    with tempfile.TemporaryDirectory() as folder:
        tmux = ["tmux", "-S", f"{folder}/socket", "-f", "/dev/null"]
        size = ["-x", str(COLUMNS), "-y", str(LINES)]
        subprocess.run([*tmux, "new-session", "-d", *size, f"COLORTERM=truecolor {drive}"], check=True)
        try:
            while "m/s" not in _screen(tmux):
                time.sleep(0.1)
            time.sleep(LEAD_IN)
            frames, waiting, caption, pressed = [], list(PRESSES), "", -CAPTION_SECONDS
            begun = time.monotonic()
            while (now := time.monotonic() - begun) < LENGTH:
                if waiting and now >= waiting[0][0]:
                    pressed, key, caption = waiting.pop(0)
                    subprocess.run([*tmux, "send-keys", key], check=True)
                    caption = f"{key}  {caption}"
                frames.append((now, _screen(tmux), caption if now < pressed + CAPTION_SECONDS else ""))
                time.sleep(max(0.0, (len(frames)) / FRAMES_PER_SECOND - (time.monotonic() - begun)))
            return frames
        finally:
            subprocess.run([*tmux, "kill-server"], check=False)


def _screen(tmux: list[str]) -> str:
    return subprocess.run(
        [*tmux, "capture-pane", "-e", "-p"], check=True, capture_output=True, text=True
    ).stdout


def draw_frame(screen: str, caption: str) -> Image.Image:
    """Draw one screen, with the pressed key beneath it."""
    regular, bold = (ImageFont.truetype(FONT.format(end), FONT_SIZE) for end in ("", "-Bold"))
    width, height = round(regular.getlength("m")), FONT_SIZE + 3
    image = Image.new("RGB", (COLUMNS * width, (LINES + 2) * height), BACKGROUND)
    draw = ImageDraw.Draw(image)
    for row, line in enumerate(Text.from_ansi(screen).split("\n")[:LINES]):
        for column, (letter, style) in enumerate(_cells(line)):
            left, top = column * width, row * height
            front, back = _color(style.color, FOREGROUND), _color(style.bgcolor, BACKGROUND)
            if style.reverse:
                front, back = back, front
            if back != BACKGROUND:
                draw.rectangle((left, top, left + width - 1, top + height - 1), back)
            if letter == "▀":
                draw.rectangle((left, top, left + width - 1, top + height // 2), front)
            elif letter == "│":
                draw.line((left + width // 2, top, left + width // 2, top + height), front)
            elif "\u2800" <= letter <= "\u28ff":  # the font has no Braille
                for bit, (x, y) in enumerate(BRAILLE_DOTS):
                    if ord(letter) >> bit & 1:
                        dot = left + 1 + x * width // 2, top + 1 + y * height // 4
                        draw.rectangle((*dot, dot[0] + 1, dot[1] + 1), front)
            elif letter.strip():
                draw.text((left, top), letter, front, bold if style.bold else regular)
    top = LINES * height
    draw.line((0, top + 2, image.width, top + 2), "#2a3440")
    if caption:
        key, _, says = caption.partition("  ")
        draw.rectangle((8, top + 7, 8 + 3 * width, top + 2 * height - 3), CAP)
        draw.text((8 + width, top + 9), key, BACKGROUND, bold)
        draw.text((8 + 5 * width, top + 9), says, FOREGROUND, regular)
    return image


def _cells(text: Text) -> list[tuple[str, object]]:
    from rich.console import Console

    console = Console()
    return [(letter, text.get_style_at_offset(console, index)) for index, letter in enumerate(text.plain)]


def _color(color: object, default: str) -> str:
    return default if color is None or color.is_default else color.get_truecolor().hex


def write_gif(path: Path, frames: list[tuple[float, str, str]]) -> None:
    """Write the frames as one GIF with one palette, so that only what changes is stored."""
    images = [draw_frame(screen, caption) for _, screen, caption in frames]
    times = [moment for moment, _, _ in frames] + [LENGTH + 1.0]
    sheet = Image.new("RGB", (images[0].width, images[0].height * 6))
    for place, image in enumerate(images[:: max(1, len(images) // 6)][:6]):
        sheet.paste(image, (0, place * image.height))
    palette = sheet.quantize(96)
    small = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    durations = [round(1000 * (after - before)) for before, after in pairwise(times)]
    small[0].save(path, save_all=True, append_images=small[1:], duration=durations, loop=0, optimize=False)
    subprocess.run(["gifsicle", "--optimize=3", "--batch", str(path)], check=True)


if __name__ == "__main__":
    write_gif(Path(sys.argv[1]), capture_frames())
