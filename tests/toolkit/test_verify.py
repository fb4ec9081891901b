"""Verification: agrees where bits agree, and finds the one bit that does not."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from softsense.cli.main import main
from softsense.errors import SoftsenseError
from softsense.pipeline import export
from softsense.verify import verify
from softsense.verify.folder import read_folder
from softsense.verify.vectors import every_input, vectors
from softsense_codegen import reference

sys.path.insert(0, str(Path(__file__).parent))

from made_networks import codes_of, make_mlp


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """Exports with one, two and three inputs."""
    made = {}
    for inputs in (1, 2, 3):
        mlp = make_mlp(inputs=inputs, hidden=(5,))
        made[inputs] = tmp_path_factory.mktemp(f"export{inputs}")
        export(mlp, codes_of(mlp), made[inputs], name="toy")
    return made


def test_every_evaluator_agrees(folders, tool) -> None:
    tool("gcc"), tool("clang")
    for inputs, folder in folders.items():
        result = verify(folder)
        assert result.good
        names = [c.evaluator for c in result.comparisons]
        expected = ["reference", "onnxruntime", "host-gcc", "host-gcc-sanitized"]
        expected += ["host-clang", "host-clang-sanitized"]
        assert names[:6] == expected
        assert all(c.mismatches == 0 for c in result.comparisons)
        if inputs <= 2:
            assert result.comparisons[-1].evaluator == "host-gcc-exhaustive"
            assert result.comparisons[-1].compared == 4096**inputs


def test_vectors_hold_what_they_promise(folders) -> None:
    folder = read_folder(folders[3])
    codes = vectors(folder.network, folder.recorded)
    rows = {tuple(row) for row in codes.tolist()}
    assert {tuple(row) for row in folder.recorded.tolist()} <= rows
    for corner in np.array(np.meshgrid(*[[i.low, i.high] for i in folder.network.inputs])).T:
        assert {tuple(int(v) for v in point) for point in corner.reshape(-1, 3)} <= rows
    assert codes.min() == -32768
    assert codes.max() == 32767
    outside = reference.uncalibrated(folder.network, codes) != 0
    assert 0.1 < outside.mean() < 0.9


def test_every_input_is_every_input_once(folders) -> None:
    net = read_folder(folders[2]).network
    seen = np.zeros((4096, 4096), dtype=np.uint8)
    rng = np.random.default_rng(0)
    for codes, expected in every_input(net):
        seen[codes[:, 0], codes[:, 1]] += 1
        pick = rng.integers(0, len(codes), size=200)
        assert np.array_equal(reference.estimate(net, codes[pick]), expected[pick])
    assert np.all(seen == 1)


def test_one_wrong_bit_in_c_or_onnx_is_found(folders, tmp_path: Path, capsys) -> None:
    spoilt = tmp_path / "spoilt"
    shutil.copytree(folders[2], spoilt)
    source = spoilt / "toy.c"
    text = source.read_text()
    y0 = text.index("uint32_t y0 = ") + len("uint32_t y0 = ")
    bias = text[y0 : text.index("u;", y0)]
    source.write_text(text.replace(f"y0 = {bias}u", f"y0 = {int(bias) ^ 1}u"))
    result = verify(spoilt, ("host",))
    assert not result.good
    assert result.comparisons[0].mismatches == result.comparisons[0].compared
    assert main(["verify", str(spoilt), "--on", "host", "--json", "-q"]) == 3
    printed = json.loads(capsys.readouterr().out)
    assert printed["evaluators"]["host-gcc"]["mismatches"] > 0
    assert main(["verify", str(spoilt), "--on", "reference,onnxruntime", "-q"]) == 0
    shutil.copy(folders[3] / "toy_int.onnx", spoilt / "toy_int.onnx")
    with pytest.raises(Exception, match=r"(?i)dimension"):
        verify(spoilt, ("onnxruntime",))


def test_a_board_that_is_too_small_is_left_out_only_where_that_is_asked(
    tmp_path: Path, tool, capsys
) -> None:
    """Two layers of 160 are 50 KB of weights, and an Uno holds 32."""
    tool("avr-gcc")
    tool("qemu-system-avr")
    mlp = make_mlp(inputs=3, hidden=(160, 160))
    export(mlp, codes_of(mlp), tmp_path, name="toy")
    result = verify(tmp_path, ("reference", "qemu:avr-uno"), where_it_fits=True)
    assert result.left_out == ("qemu:avr-uno",)
    assert [c.evaluator for c in result.comparisons] == ["reference"]
    with pytest.raises(SoftsenseError, match="firmware for avr-uno: the networks do not fit"):
        verify(tmp_path, ("qemu:avr-uno",))
    assert main(["verify", str(tmp_path), "--on", "qemu:avr-uno"]) == 1
    assert "--optimise size" in capsys.readouterr().err


def test_the_json_has_the_agreed_shape(folders, capsys) -> None:
    assert main(["verify", str(folders[1]), "--on", "reference,onnxruntime", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert set(data) == {"digest", "vectors", "evaluators", "fixed_vs_float"}
    assert set(data["evaluators"]["onnxruntime"]) == {"compared", "mismatches", "seconds"}
    assert {"max_abs", "bound", "unit"} <= set(data["fixed_vs_float"])
    assert data["fixed_vs_float"]["max_abs"] <= data["fixed_vs_float"]["bound"]


def test_folders_that_are_not_whole_are_refused(folders, tmp_path: Path, capsys) -> None:
    with pytest.raises(SoftsenseError, match="not an export folder"):
        verify(tmp_path)
    spoilt = tmp_path / "spoilt"
    shutil.copytree(folders[1], spoilt)
    whole = (spoilt / "toy.json").read_text()
    (spoilt / "toy.json").write_text(whole[: len(whole) // 2])
    with pytest.raises(SoftsenseError, match=r"toy\.json"):
        verify(spoilt)
    (spoilt / "toy.json").write_text((folders[2] / "toy.json").read_text())
    with pytest.raises(SoftsenseError, match="different exports"):
        verify(spoilt)
    (spoilt / "toy.json").write_text(whole)
    (spoilt / "toy_int.onnx").write_bytes(b"no onnx")
    with pytest.raises(SoftsenseError, match=r"toy_int\.onnx"):
        verify(spoilt, ("onnxruntime",))
    with pytest.raises(SoftsenseError, match="no evaluator 'magic'"):
        verify(folders[1], ("magic",))
    assert main(["verify", str(spoilt), "--on", "onnxruntime"]) == 1
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_the_manifest_tells_what_a_user_needs(folders) -> None:
    manifest = json.loads((folders[2] / "manifest.json").read_text())
    assert [i["name"] for i in manifest["inputs"]] == ["s1", "s2"]
    assert {"low", "high"} <= set(manifest["inputs"][0])
    assert {"lsb", "unit", "zero"} <= set(manifest["outputs"][0])
    for name in manifest["files"]:
        assert (folders[2] / name).is_file(), name
    assert manifest["digest"] == read_folder(folders[2]).network.digest


def test_exporting_twice_gives_identical_bytes(folders, tmp_path: Path) -> None:
    mlp = make_mlp(inputs=2, hidden=(5,))
    export(mlp, codes_of(mlp), tmp_path / "again", name="toy")
    files = [path for path in sorted(folders[2].rglob("*")) if path.is_file()]
    assert len(files) >= 9
    for path in files:
        other = tmp_path / "again" / path.relative_to(folders[2])
        assert path.read_bytes() == other.read_bytes(), path.name


def test_a_failed_export_leaves_no_manifest(tmp_path: Path) -> None:
    """The manifest comes last: where it is, the folder is whole."""
    mlp = make_mlp(inputs=2, hidden=(5,))
    (tmp_path / "toy_int.onnx").mkdir()  # cannot be replaced by a file, as on a full disk
    with pytest.raises(SoftsenseError, match="cannot write"):
        export(mlp, codes_of(mlp), tmp_path, name="toy")
    assert not (tmp_path / "manifest.json").exists()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
