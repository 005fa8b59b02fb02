# SPDX-License-Identifier: Apache-2.0
"""The stub says what the compiled part is, name by name and argument by argument, and every public name is described."""

import ast
import inspect
import pathlib
import re
import unittest
from typing import Dict, List, Set

import prescene
from prescene import _prescene, collision

FOLDER = pathlib.Path(prescene.__file__).parent
# Python's own, and what every class has.
COMMON = {"__init__", "__repr__", "__iter__", "__next__", "__float__"}


def stub() -> ast.Module:
    return ast.parse((FOLDER / "_prescene.pyi").read_text())


def members(node: ast.ClassDef) -> Set[str]:
    return {one.name for one in node.body if isinstance(one, ast.FunctionDef)}


def runtime_arguments(function: object) -> List[str]:
    """The names in the signature that pybind11 writes into a docstring."""
    match = re.search(r"\((.*)\) -> ", (inspect.getdoc(function) or "").splitlines()[0])
    assert match, function
    return re.findall(r"(\w+): ", match[1])


class Stubs(unittest.TestCase):
    def test_types_are_shipped(self) -> None:
        self.assertTrue((FOLDER / "py.typed").exists())

    def test_same_names(self) -> None:
        written = {node.name for node in stub().body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        there = {name for name in vars(_prescene) if not name.startswith("__")}
        self.assertEqual(written, there)

    def test_same_members(self) -> None:
        for node in stub().body:
            if not isinstance(node, ast.ClassDef):
                continue
            there = {name for name in vars(getattr(_prescene, node.name)) if not name.startswith("_")}
            with self.subTest(name=node.name):
                self.assertEqual(members(node) - COMMON, there)

    def test_same_arguments(self) -> None:
        written: Dict[str, List[str]] = {}
        for node in stub().body:
            if isinstance(node, ast.FunctionDef):
                written[node.name] = [one.arg for one in node.args.args]
            if isinstance(node, ast.ClassDef):
                for one in node.body:
                    if isinstance(one, ast.FunctionDef) and not one.decorator_list:
                        written[f"{node.name}.{one.name}"] = [argument.arg for argument in one.args.args]
        checked = 0
        for name, arguments in written.items():
            part = _prescene
            for word in name.split("."):
                part = getattr(part, word)
            if name.split(".")[-1] in COMMON - {"__init__"}:
                continue
            if name.endswith("__init__") and "__init__" not in vars(getattr(_prescene, name.split(".")[0])):
                continue
            with self.subTest(name=name):
                self.assertEqual([one for one in runtime_arguments(part) if one not in ("self", "arg0")], [one for one in arguments if one != "self"])
                checked += 1
        self.assertGreater(checked, 12)

    def test_properties_have_return_types(self) -> None:
        for node in ast.walk(stub()):
            if isinstance(node, ast.FunctionDef):
                self.assertIsNotNone(node.returns, node.name)

    def test_all_that_is_exported_is_there_and_described(self) -> None:
        for module in (prescene, collision):
            for name in module.__all__:
                thing = getattr(module, name)
                if inspect.isclass(thing) and thing.__module__.endswith("_prescene"):
                    continue  # described in the stub
                if callable(thing):
                    self.assertTrue(inspect.getdoc(thing), name)
        described = {node.name for node in stub().body if isinstance(node, ast.ClassDef) and ast.get_docstring(node)}
        self.assertEqual(described, {node.name for node in stub().body if isinstance(node, ast.ClassDef)})

    def test_sources_are_fully_annotated(self) -> None:
        for path in FOLDER.glob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.FunctionDef):
                    self.assertIsNotNone(node.returns, f"{path.name}: {node.name}")
                    for argument in node.args.args + node.args.kwonlyargs:
                        self.assertTrue(argument.annotation or argument.arg == "self", f"{path.name}: {node.name}")


if __name__ == "__main__":
    unittest.main()
