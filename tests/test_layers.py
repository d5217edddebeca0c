"""Imports point one way: tuning, then scenarios, then adwa_jax, and the kernels need JAX, NumPy and chex only."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LAYERS = ("tuning", "scenarios", "adwa_jax")
KERNEL_PACKAGES = {"jax", "numpy", "chex"}


def imported_packages(file):
    """Top-level packages that a file imports anywhere, also inside functions and for type checking only."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno} imports relatively, past this test"
            found.add(str(node.module).partition(".")[0])
    return found


def files_of(package):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    return files


@pytest.mark.parametrize(("package", "forbidden"), [("adwa_jax", {"scenarios", "tuning"}), ("scenarios", {"tuning"})])
def test_no_package_imports_one_above_it(package, forbidden):
    for file in files_of(package):
        assert not imported_packages(file) & forbidden, file


def test_kernels_import_jax_numpy_chex_and_the_standard_library_only():
    for file in files_of("adwa_jax"):
        strangers = imported_packages(file) - KERNEL_PACKAGES - {"adwa_jax"} - set(sys.stdlib_module_names)
        assert not strangers, file


@pytest.mark.parametrize("package", LAYERS)
def test_no_package_imports_the_tests(package):
    for file in files_of(package):
        assert "tests" not in imported_packages(file), file


@pytest.mark.parametrize("package", LAYERS)
def test_no_module_has_a_name_that_says_nothing(package):
    names = {file.stem for file in files_of(package)} | {file.parent.name for file in files_of(package)}
    assert not names & {"utils", "util", "common", "helpers", "misc", "core"}


def test_the_reader_of_imports_sees_every_kind(tmp_path):
    file = tmp_path / "some.py"
    inner = "def f():\n    import scenarios.suite\n    from tuning import cli\n"
    file.write_text("import os.path\nfrom typing import Any\n" + inner)
    assert imported_packages(file) == {"os", "typing", "scenarios", "tuning"}
