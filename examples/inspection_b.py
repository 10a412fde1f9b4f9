"""An inspection robot with three arms and a shifting body passes a clamp (fig. 12)."""

from inspection_a import strip

import robsim as rs

SHOWN = {
    "approach by sight": "it sees the clamp",
    "the front arm passes": "body back, the front arm passes",
    "the middle arm passes": "body amid, the middle arm passes",
    "the rear arm passes": "body ahead, the rear arm passes",
    "the body goes to its place": "the clamp is behind",
}

if __name__ == "__main__":
    done = rs.load_scenario(rs.examples.path("inspection_b")).run()
    print(done)
    strip(done, SHOWN, extent=(2.0, 1.25)).savefig("inspection_b.png", dpi=150)
