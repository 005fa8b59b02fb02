# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import tempfile
import unittest
from typing import Any

import numpy as np
import support

import prescene

QUICK = {"max_instances": 64}


class Predict(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = support.write_scene(pathlib.Path(cls.folder.name))
        cls.scene = prescene.load_scene(cls.path)

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def test_is_bit_for_bit_the_command_line(self) -> None:
        for arguments, options in (
            (["--seed", "7", "--tolerance", "0.05"], {"seed": 7, "half_width": 0.05}),
            (["--seed", "2", "--tolerance", "0.1", "--stepper", "bullet"], {"seed": 2, "half_width": 0.1, "stepper": "bullet"}),
            (["--outcomes-only", "--max-instances", "96", "--confidence", "0.9"], {"outcomes_only": True, "max_instances": 96, "confidence": 0.9}),
            (["--duration", "0.5", "--max-instances", "64"], {"duration": 0.5, "max_instances": 64}),
        ):
            with self.subTest(arguments=arguments):
                expected = support.program_json("predict", str(self.path), *arguments)
                found = prescene.predict(self.scene, **options).json
                self.assertEqual(support.without_times(found), support.without_times(expected))

    def test_of_a_scenario_with_a_held_object(self) -> None:
        path = support.SCENARIOS / "milk_on_bin.yaml"
        expected = support.program_json("predict", str(path), "--tolerance", "0.1", "--seed", "5")
        found = prescene.predict(prescene.load_scene(path), half_width=0.1, seed=5)
        self.assertEqual(support.without_times(found.json), support.without_times(expected))

    def test_threads_change_no_bit(self) -> None:
        one = prescene.predict(self.scene, max_instances=96, threads=1).json
        two = prescene.predict(self.scene, max_instances=96, threads=2).json
        self.assertEqual(support.without_times(one), support.without_times(two))

    def test_values_are_those_of_the_document(self) -> None:
        prediction = prescene.predict(self.scene, max_instances=128, half_width=1e-3)
        self.assertEqual(prediction.instances, 128)
        self.assertFalse(prediction.converged)
        self.assertAlmostEqual(sum(one.probability for one in prediction if one.group == "where"), 1.0)
        for one in prediction.outcomes:
            self.assertLessEqual(one.low, one.probability)
            self.assertLessEqual(one.probability, one.high)
        self.assertEqual(prediction["on_table"], prediction["where.on_table"])
        with self.assertRaisesRegex(prescene.InputError, "there are where.on_table"):
            prediction["in_bin"]
        end = prediction.final_poses[0]
        self.assertEqual(end.object, "parcel")
        self.assertAlmostEqual(end.heat_map.mass.sum(), 1.0, places=3)
        self.assertAlmostEqual(sum(one.weight for one in end.components), 1.0, places=6)
        mean = sum(one.weight * one.X_WO[:3, 3] for one in end.components)
        np.testing.assert_allclose(mean, end.mean_position, atol=0.02)
        # The document is plain JSON.
        self.assertEqual(json.loads(json.dumps(prediction.json)), prediction.json)

    def test_own_actions_and_outcomes(self) -> None:
        still = prescene.predict(self.scene, actions=[], outcomes={"moved": {"object": "parcel", "moved_more_than": 0.05}}, **QUICK)
        # No push. (Without actions of one's own those of the scene are taken; "at the end" the box has moved then.)
        self.assertEqual([one.name for one in still.outcomes], ["moved"])

    def test_numpy_numbers_in_questions(self) -> None:
        actions = [{"time": np.float32(0.0), "push": {"from": np.array([-0.05, 0.0, 0.02]), "to": np.array([0.0, 0, 0.02]), "duration": np.float64(0.5)}}]
        self.assertEqual(len(prescene.predict(self.scene, actions=actions, **QUICK)), 3)

    def test_what_is_refused(self) -> None:
        cases: "list[tuple[type[BaseException], dict[str, Any]]]" = [
            (prescene.InputError, {"half_width": 0.0}),
            (prescene.InputError, {"half_width": float("nan")}),
            (prescene.InputError, {"confidence": 1.0}),
            (prescene.InputError, {"max_instances": 0}),
            (prescene.InputError, {"max_instances": 2**40}),
            (prescene.InputError, {"duration": -1.0}),
            (prescene.InputError, {"duration": float("inf")}),
            (prescene.InputError, {"max_seconds": 0.0}),
            (prescene.InputError, {"seed": -1}),
            (prescene.InputError, {"seed": 2**64}),
            (TypeError, {"seed": 1.5}),
            (TypeError, {"seed": True}),
            (prescene.InputError, {"threads": -1}),
            (prescene.InputError, {"threads": 10**6}),
            (TypeError, {"threads": 10**30}),
            (TypeError, {"threads": None}),
            (prescene.InputError, {"stepper": "newton"}),
            (TypeError, {"stepper": 3}),
            (prescene.InputError, {"outcomes": {"x": {"object": "mug", "below": 0}}}),
            (prescene.InputError, {"actions": [{"time": 0, "throw": {}}]}),
            (prescene.InputError, {"actions": "push"}),
            (prescene.InputError, {"paths": -1}),
            (TypeError, {"outcomes": {"x": object()}}),
        ]
        for kind, options in cases:
            with self.subTest(options=str(options)):
                with self.assertRaises(kind):
                    prescene.predict(self.scene, **options)

    def test_the_largest_seed(self) -> None:
        self.assertEqual(prescene.predict(self.scene, seed=2**64 - 1, **QUICK).json["seed"], 2**64 - 1)


class Ask(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.scene = prescene.Scene.from_yaml(support.PUSHED_BOX)

    def test_all_tasks(self) -> None:
        where = prescene.ask(self.scene, {"id": "w", "where": {}})
        self.assertEqual((where["id"], where["where"]["items"][0]["object"]), ("w", "parcel"))
        np.testing.assert_allclose(
            prescene.matrix(where["where"]["items"][0]["estimate"]["mean"])[:3, 3], [0.1, 0.0, 0.025], atol=0.01
        )
        stability = prescene.ask(self.scene, {"stability": {"object": "parcel", "effort": QUICK}})["stability"]
        self.assertGreater(stability["stable"]["probability"], 0.9)
        view = prescene.ask(self.scene, {"view": {"time": 0}})["view"]
        self.assertEqual((view["depth"]["width"], view["depth"]["height"]), (160, 120))
        achieve = prescene.ask(
            self.scene,
            {
                "achieve": {
                    "outcome": "moved",
                    "action": "push",
                    "object": "parcel",
                    "free": {"distance": [0.02, 0.2]},
                    "survey": False,
                    "effort": {"max_instances": 512},
                }
            },
        )["achieve"]
        self.assertIn("best", achieve)
        predict = prescene.ask(self.scene, '{"predict": {"effort": {"max_instances": 64}}}')
        self.assertEqual(len(predict["predict"]["outcomes"]), 3)

    def test_same_seed_same_answer(self) -> None:
        question = {"stability": {"object": "parcel", "effort": QUICK}}
        answers = [support.without_times(prescene.ask(self.scene, question, seed=seed)["stability"]) for seed in (4, 4, 5)]
        self.assertEqual(answers[0], answers[1])

    def test_what_is_refused(self) -> None:
        loop: "dict[str, Any]" = {}
        loop["where"] = loop
        for kind, question in (
            (prescene.InputError, ""),
            (prescene.InputError, "{"),
            (prescene.InputError, "[1]"),
            (prescene.InputError, {}),
            (prescene.InputError, {"wehre": {}}),
            (prescene.InputError, {"where": {"object": "mug"}}),
            (prescene.InputError, {"where": {}, "view": {}}),
            (prescene.InputError, {"stability": {"object": "parcel", "max_move": float("nan")}}),
            (prescene.InputError, loop),
            (prescene.InputError, "[" * 100000),
            (prescene.InputError, '{"where": {}}' + " " * 2**25),
            (prescene.InputError, '{"id": "\udcff", "where": {}}'.encode("utf-8", "surrogateescape").decode("latin-1") + "x"),
            (TypeError, None),
            (TypeError, 3),
            (TypeError, {"where": {1, 2}}),
        ):
            with self.subTest(question=str(question)[:60]):
                with self.assertRaises(kind):
                    prescene.ask(self.scene, question)  # type: ignore[arg-type]
        with self.assertRaises(TypeError):
            prescene.ask(None, {"where": {}})  # type: ignore[arg-type]
        with self.assertRaises((TypeError, ValueError)):
            prescene.ask(self.scene, '{"id": "\udcff", "where": {}}')

    def test_not_found_has_its_code(self) -> None:
        with self.assertRaises(prescene.InputError) as caught:
            prescene.ask(self.scene, {"where": {"object": "mug"}})
        self.assertEqual(caught.exception.code, "not_found")


if __name__ == "__main__":
    unittest.main()
