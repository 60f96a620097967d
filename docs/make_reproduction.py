"""Make docs/reproduction.md: ``python docs/make_reproduction.py`` copies ``defmanip reproduce``."""

import json
import shutil
from pathlib import Path

from defmanip_gym.reproduction.config import ReproductionConfig
from defmanip_gym.reproduction.page import NUMBERS_FILE, render_page
from defmanip_gym.reproduction.reproduce import run_reproduction

DOCS = Path(__file__).parent
IMAGES = "images/reproduction/"

if __name__ == "__main__":
    results = run_reproduction(ReproductionConfig(fresh=True)).parent
    (DOCS / IMAGES).mkdir(parents=True, exist_ok=True)
    for path in (*sorted(results.glob("*.png")), results / NUMBERS_FILE):
        shutil.copyfile(path, DOCS / IMAGES / path.name)
    numbers = json.loads((results / NUMBERS_FILE).read_text())
    (DOCS / "reproduction.md").write_text(render_page(numbers, image_folder=IMAGES))
