"""Data: the 150 pairs of camera poses of the CNS paper, as src/robsim/suites/published/cns_150.csv.

Program: NumPy (`pip install numpy`).
Needs:   a checkout of https://github.com/hhcaz/CNS (MIT License), commit 6b42138.
Run:     python tests/oracles/generate_cns_pairs.py CHECKOUT
Writes:  cns_150.csv, a line for each pair in the order of the scenes in cns/benchmark/scenes:
         the first three rows of target_wcT, then the first three rows of initial_wcT, row by row.

Both are poses T_w_c of the camera, with z along its axis; the middle of the scene is the origin.
The numbers have all their digits. The file begins with the source and the licence of the poses.
"""

import json
import sys
from pathlib import Path

import numpy as np

CSV = Path(__file__).parents[2] / "src" / "robsim" / "suites" / "published" / "cns_150.csv"
HEAD = """\
The 150 pairs of camera poses of the paper "CNS: Correspondence Encoded Neural Image Servo Policy"
(Chen, Yu, Wang and Xiong, arXiv 2309.09047, 2023), from https://github.com/hhcaz/CNS, commit
6b42138, folder cns/benchmark/scenes. Each line is a pair: the first three rows of the pose T_w_c
of the camera at the goal (target_wcT), then the first three rows at the start (initial_wcT).
Lengths are in metres. Written by tests/oracles/generate_cns_pairs.py.

The poses have this licence:

"""


def main(checkout: Path) -> None:
    """Write the file."""
    scenes = []
    for file in sorted((checkout / "cns" / "benchmark" / "scenes").glob("*.json")):
        scenes += json.loads(file.read_text(encoding="utf-8"))
    poses = np.array([[each["target_wcT"], each["initial_wcT"]] for each in scenes])
    assert poses.shape == (150, 2, 4, 4) and (poses[..., 3, :] == [0, 0, 0, 1]).all()
    licence = (checkout / "LICENSE").read_text(encoding="utf-8").strip()
    head = "\n".join(f"# {line}".rstrip() for line in (HEAD + licence).splitlines())
    rows = [",".join(map(repr, row)) for row in poses[..., :3, :].reshape(150, 24).tolist()]
    CSV.write_text("\n".join([head, *rows, ""]), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
