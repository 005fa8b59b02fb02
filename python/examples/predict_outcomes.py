#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What happens to a carton that is let go over a bin, how sure that is, and what decides it.

    predict_outcomes.py [SCENE]
"""

import sys

import numpy as np

import prescene


def main(path: str) -> None:
    scene = prescene.load_scene(path)
    for thing in scene.objects:
        spread = 1e3 * np.sqrt(np.diag(thing.covariance)[3:])
        print(f"{thing.name}: {thing.model.mass.mean:g} kg, starts at {thing.X_WO[:3, 3]} m, known to {spread.round(1)} mm")

    prediction = prescene.predict(scene, seed=1, half_width=0.03)
    for outcome in prediction:
        print(f"{outcome.group or '-':8} {outcome.name:12} {outcome.probability:.3f}  {outcome.low:.3f} to {outcome.high:.3f}")
    for end in prediction.final_poses:
        grid = end.heat_map
        row, column = np.unravel_index(np.argmax(grid.mass), grid.mass.shape)
        x, y = grid.x0 + (column + 0.5) * grid.cell, grid.y0 + (row + 0.5) * grid.cell
        print(f"{end.object} most often ends about x = {x:.2f}, y = {y:.2f} m")
    for about in prediction.json.get("inputs", []):
        if about["inputs"]:
            first = about["inputs"][0]
            print(f"{about['about']} is decided above all by {first['input']} ({100 * first['share']:.0f} %)")

    # Another question about the same scene, in the words of docs/reference/queries.md: an outcome of one's own.
    first_object = scene.objects[0].name
    own = prescene.predict(
        scene,
        half_width=0.03,
        outcomes_only=True,
        outcomes={"goes far": {"object": first_object, "moved_more_than": 0.5}},
    )
    print(f"{first_object} ends more than half a metre away: {own['goes far'].probability:.2f}")
    for remark in prediction.remarks:
        print("Note:", remark)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "/usr/share/prescene/scenarios/milk_on_bin.yaml")
