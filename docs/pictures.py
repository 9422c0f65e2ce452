"""Make the pictures of gallery.md by the commands that it states, and the one of README.md.

``python docs/pictures.py`` needs memscal in the active environment; it takes some minutes.
"""

import os
import re
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure
from PIL import Image
from store_notebooks import few_colours

import memscal
from memscal.figures import style
from memscal.figures.calibration import draw_radial
from memscal.figures.calibration_scan import draw_scans
from memscal.figures.friction_profiles import draw_profiles

DOCS = Path(__file__).resolve().parent
DATA = DOCS.with_name("calibration_data")
WIDTH = 1080  # of every picture, in pixels


def store(picture: Path) -> None:
    """Store a PNG among the documentation's images, of few pixels and colours."""
    image = Image.open(picture).convert("RGB")
    size = (WIDTH, round(WIDTH * image.height / image.width))
    image = image.resize(size, Image.Resampling.LANCZOS)
    few_colours(image).save(DOCS / "images" / picture.name, optimize=True)


def overview() -> Figure:
    """From a rod scan to G, and from G to friction: three panels of three figures."""
    rod, *contacts = (
        DATA / "sphere_experiment" / f"{name}.h5"
        for name in ("rod_scan", "sphere_dry", "sphere_lubricated")
    )
    sensor = memscal.calibrate(rod, method="bayesian").apparatus
    comparison = memscal.compare(
        [memscal.read_scan(path) for path in contacts], sensor, loading="incremental"
    )
    dry = [one for one in comparison.loads["incremental"] if one.lubrication == "dry"]
    note = f"Synthetic data. {style.COVERAGE_NOTE}"
    with style.panels_of(2.9, 1, 3, note) as (figure, panels):
        draw_scans(panels[:1], [("", sensor)])
        draw_radial(panels[1], sensor)
        draw_profiles(panels[2], comparison, dry)
        panels[0].set(xlabel="position $x$ (mm)", xlim=(-5, 5))
        panels[1].set_xlabel(style.ALONG_RADIUS)
        panels[2].set(xlabel=style.ALONG_RADIUS, xlim=(0, 6))
        for axes in panels:
            style.legend_above(axes, columns=1 if axes is not panels[2] else 2)
    return figure


def main() -> None:
    """Make all pictures in a folder of their own, and store those that the page shows."""
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    commands = "".join(re.findall(r"^```console\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / DATA.name).symlink_to(DATA)
        environment = os.environ | {"SOURCE_DATE_EPOCH": "0"}
        # Exit code 1: done, but a quality check failed.
        bash = ["bash", "-uxo", "pipefail", "-c", commands]
        subprocess.run(bash, cwd=folder, env=environment, stdout=subprocess.DEVNULL, check=False)
        (folder / "overview.png").write_bytes(style.render_figure(overview(), "png"))
        for stem in ("overview", *re.findall(r"\(images/([\w-]+)\.png\)", page)):
            (picture,) = folder.rglob(f"{stem}.png")
            store(picture)


if __name__ == "__main__":
    main()
