"""Arrows point only downward: a module imports only from layers below its own."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# From top to bottom. A module may import from its own entry and from any entry after it.
LAYERS = [
    ("softsense.__main__",),
    ("softsense.cli",),
    ("softsense.sklearn",),
    ("softsense.pipeline",),
    ("softsense.report.building",),
    ("softsense.verify",),
    ("softsense.device",),
    ("softsense.diagnose",),
    ("softsense.report",),
    ("softsense.simulate",),
    ("softsense.effects",),
    ("softsense.quantise",),
    ("softsense.onnx_file", "softsense.onnx_import"),
    ("softsense.train",),
    ("softsense.select",),
    ("softsense.information",),
    ("softsense.mlp",),
    ("softsense.recording",),
    ("softsense.notebook",),
    ("softsense.errors",),
    ("softsense_codegen.generate", "softsense_codegen.packages"),
    ("softsense_codegen.render",),
    ("softsense_codegen.view",),
    ("softsense_codegen.reference", "softsense_codegen.bounds"),
    ("softsense_codegen.network",),
    ("softsense_codegen.fixed",),
    ("softsense_codegen.atomic",),
    ("softsense_codegen.errors",),
]
LEAF_MAY_IMPORT = {"numpy", "jinja2"}


def layer_of(module: str) -> int | None:
    for depth, names in enumerate(LAYERS):
        if any(module == name or module.startswith(name + ".") for name in names):
            return depth
    return None


def imports_of(source: str) -> set[str]:
    """Every absolute import, those within functions too."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level:
            raise AssertionError("relative imports hide the arrow: name the package")
    return found


def modules() -> list[tuple[str, Path]]:
    result = []
    for root in ("toolkit", "codegen"):
        for path in sorted((ROOT / root).rglob("*.py")):
            parts = path.relative_to(ROOT / root).with_suffix("").parts
            name = ".".join(part for part in parts if part != "__init__")
            result.append((name, path))
    return result


def upward(name: str, source: str) -> list[str]:
    own = layer_of(name)
    wrong = []
    for target in sorted(imports_of(source)):
        depth = layer_of(target)
        if own is not None and depth is not None and depth < own:
            wrong.append(f"{name} -> {target}")
        if name.startswith("softsense_codegen") and target.split(".")[0] == "softsense":
            wrong.append(f"{name} -> {target}")
    return wrong


@pytest.mark.parametrize(("name", "path"), modules(), ids=lambda value: str(value))
def test_arrows_point_downward(name: str, path: Path) -> None:
    assert upward(name, path.read_text()) == []


def test_every_module_has_a_layer() -> None:
    packages = {"softsense", "softsense_codegen"}
    lost = [name for name, _ in modules() if name not in packages and layer_of(name) is None]
    assert lost == []


def test_an_upward_import_is_caught() -> None:
    assert upward("softsense.recording", "from softsense.train import fit") != []
    assert upward("softsense_codegen.fixed", "import softsense.mlp") != []
    assert upward("softsense.train", "def f():\n    from softsense.cli import main") != []


def test_the_leaf_needs_only_numpy_and_jinja2() -> None:
    import sys

    for name, path in modules():
        if name.startswith("softsense_codegen"):
            tops = {target.split(".")[0] for target in imports_of(path.read_text())}
            extra = tops - LEAF_MAY_IMPORT - {"softsense_codegen"} - set(sys.stdlib_module_names)
            assert extra == set(), f"{name} imports {extra}"


def test_there_is_no_init_in_the_roots() -> None:
    assert not (ROOT / "toolkit" / "__init__.py").exists()
    assert not (ROOT / "codegen" / "__init__.py").exists()
