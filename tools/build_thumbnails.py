"""Draw the pictures of the shipped experiments for the gallery of the studio.

python tools/build_thumbnails.py [NAME ...]     all by default

Each picture has the scene at the end of the run, with the path of the camera, and the image with
the paths of the feature points. It is a small WebP file in the folder of the shipped scenarios.
"""

import sys
import warnings
from pathlib import Path

import robsim as rs

sys.path.insert(0, str(Path(__file__).parent / "site"))
from experiment_pictures import draw_scene_and_image

SCENE, IMAGE = (196, 200), (124, 200)  # pixels of the parts of a picture
QUALITY = 60  # of WebP
TARGET = Path(rs.examples.path("visp_tutorial")).parent / "thumbnails"


def main() -> None:
    """Draw the pictures, and print their total size."""
    TARGET.mkdir(exist_ok=True)
    for name in sys.argv[1:] or rs.examples.names():
        experiment = rs.load_scenario(rs.examples.path(name))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rs.errors.RankWarning)  # some lose rank on purpose
            run = experiment.run()
        picture = draw_scene_and_image(experiment, run, SCENE, IMAGE)
        picture.save(TARGET / f"{name}.webp", "WEBP", quality=QUALITY, method=6)
    sizes = [each.stat().st_size for each in TARGET.glob("*.webp")]
    print(f"{len(sizes)} pictures of together {sum(sizes) / 1000:.0f} kB in {TARGET}")


if __name__ == "__main__":
    main()
