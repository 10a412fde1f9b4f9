"""Update the JavaScript libraries of the page: bundle them from npm into src/robsim/page/static.

python tools/vendor_page.py            needs Node.js and the npm registry

It writes vendor.js, one script that defines `vendor`, vendor.css, and vendor.json: the version,
licence and integrity of each package, and the SHA-256 of both files, which a test compares.
"""

import hashlib
import json
import subprocess
import tempfile
from pathlib import Path

STATIC = Path(__file__).parents[1] / "src" / "robsim" / "page" / "static"
PACKAGES = {"three": "0.187.0", "uplot": "1.6.32", "lil-gui": "0.21.0"}
ESBUILD = "0.28.2"
LOCK_FIELDS = ("version", "license", "integrity")
THREE = """
AxesHelper Box3 BufferAttribute BufferGeometry Color DirectionalLight DoubleSide GridHelper Group
HemisphereLight Line LineBasicMaterial LineDashedMaterial LineSegments Mesh MeshBasicMaterial
MeshStandardMaterial PCFShadowMap PerspectiveCamera PlaneGeometry Raycaster Scene ShadowMaterial
Sphere SphereGeometry Vector2 Vector3 WebGLRenderer
"""
NAMES = ", ".join(THREE.split())
ENTRY = f"""
import {{ {NAMES} }} from "three";
export const THREE = {{ {NAMES} }};
export {{ OrbitControls }} from "three/addons/controls/OrbitControls.js";
export {{ TransformControls }} from "three/addons/controls/TransformControls.js";
export {{ default as uPlot }} from "uplot";
export {{ default as GUI }} from "lil-gui";
"""


def main() -> None:
    """Install the packages, bundle them, and write the three files."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "package.json").write_text('{"private": true}')
        packages = [f"{each}@{version}" for each, version in PACKAGES.items()]
        _run(folder, "npm", "install", "--save-exact", *packages, f"esbuild@{ESBUILD}")
        (folder / "entry.js").write_text(ENTRY)
        bundle = ("--bundle", "--minify", "--format=iife", "--global-name=vendor")
        _run(folder, "npx", "esbuild", "entry.js", *bundle, "--outfile=vendor.js")
        modules = folder / "node_modules"
        script = _licences(modules) + (folder / "vendor.js").read_text(encoding="utf-8")
        sheets = ("uplot/dist/uPlot.min.css", "lil-gui/dist/lil-gui.min.css")
        style = "".join((modules / sheet).read_text(encoding="utf-8") for sheet in sheets)
        (STATIC / "vendor.js").write_text(script, encoding="utf-8")
        (STATIC / "vendor.css").write_text(style, encoding="utf-8")
        lock = json.loads((folder / "package-lock.json").read_text())["packages"]
    (STATIC / "vendor.json").write_text(
        json.dumps(_describe_bundle(lock, script, style), indent=2) + "\n"
    )


def _licences(modules: Path) -> str:
    """Return the licences of all packages as a comment."""
    texts = [
        f"{name} {version}\n\n{_licence(modules / name)}" for name, version in PACKAGES.items()
    ]
    return "/*\n" + "\n\n----\n\n".join(texts).replace("*/", "* /") + "\n*/\n"


def _licence(package: Path) -> str:
    (path,) = package.glob("LICENSE*")
    return path.read_text(encoding="utf-8").strip()


def _describe_bundle(lock: dict[str, dict[str, str]], script: str, style: str) -> dict[str, object]:
    packages = {
        name: {key: lock[f"node_modules/{name}"][key] for key in LOCK_FIELDS} for name in PACKAGES
    }
    files = {"vendor.js": script, "vendor.css": style}
    hashes = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in files.items()}
    return {"packages": packages, "sha256": hashes}


def _run(folder: Path, *command: str) -> None:
    subprocess.run(command, cwd=folder, check=True)


if __name__ == "__main__":
    main()
