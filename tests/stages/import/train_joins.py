#!/usr/bin/env python3
"""Learns from pairs of parts which are one thing (python3-sklearn):
  train_joins.py TRAINING.csv... > stages/import/join_trees.inc
  train_joins.py --choose TRAINING.csv...    figures of depths and numbers of trees
Boosted regression trees, written as complete trees: split n sends what is at most its threshold to 2 n + 1,
the rest to 2 n + 2."""
import csv
import sys

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import GroupShuffleSplit

TREES, DEPTH, RATE = 300, 5, 0.1
CRUMB = 100  # points


def read(paths):
    names, rows, scenes, crumbs = None, [], [], 0
    for path in paths:
        with open(path) as file:
            table = csv.reader(file)
            header = next(table)[4:]
            assert names in (None, header), f"{path} has other clues"
            names = header
            for row in table:
                # Many pairs are crumbs that are told again and again: one of three of them stands for three.
                crumbs += int(row[2]) < CRUMB
                if int(row[2]) < CRUMB and crumbs % 3:
                    continue
                rows.append(np.array(row[1:], dtype=float))
                scenes.append(row[0].rsplit("-", 1)[0])
    data, scenes = np.array(rows, dtype=float), np.array(scenes)
    crumb = data[:, 1] < CRUMB
    x, one = data[:, 3:], data[:, 0].astype(int)
    # A wrong join of large parts costs a thing, of crumbs nothing; each scene counts alike.
    weight = np.clip(data[:, 1] / 600, 0.05, 1) * np.where(crumb, 3, 1)
    _, scene, = np.unique(scenes, return_inverse=True)
    weight /= np.bincount(scene, weight)[scene] ** 0.5
    return names, x, one, weight / weight.mean(), scenes


def model(trees=TREES, depth=DEPTH):
    return HistGradientBoostingClassifier(max_iter=trees, max_depth=depth, max_leaf_nodes=None, learning_rate=RATE,
                                          min_samples_leaf=80, l2_regularization=5, early_stopping=False,
                                          random_state=1)


def complete(nodes):
    """Features, thresholds and leaves of a tree, padded to its full depth."""
    feature, threshold, leaf = [0] * (2 ** DEPTH - 1), [0.0] * (2 ** DEPTH - 1), [0.0] * 2 ** DEPTH

    def fill(node, at):
        if at >= 2 ** DEPTH - 1:
            leaf[at - 2 ** DEPTH + 1] = nodes[node]["value"]
        elif nodes[node]["is_leaf"]:
            fill(node, 2 * at + 1)
            fill(node, 2 * at + 2)
        else:
            feature[at] = int(nodes[node]["feature_idx"])
            threshold[at] = float(f"{nodes[node]['num_threshold']:.7g}")  # midpoints of numbers of five digits
            fill(nodes[node]["left"], 2 * at + 1)
            fill(nodes[node]["right"], 2 * at + 2)

    fill(0, 0)
    return feature, threshold, leaf


def choose(x, one, weight, scenes):
    """Figures on a third of the scenes that was held back."""
    train, test = next(GroupShuffleSplit(1, test_size=1 / 3, random_state=1).split(x, one, scenes))
    w = weight[test] / weight[test].sum()
    for depth in (3, 4, 5):
        m = model(400, depth).fit(x[train], one[train], sample_weight=weight[train])
        for count, p in enumerate(m.staged_predict_proba(x[test]), 1):
            if count % 100 == 0:
                p = np.clip(p[:, 1], 1e-6, 1 - 1e-6)
                loss = -np.log(np.where(one[test] == 1, p, 1 - p))
                print(f"depth {depth}, {count} trees: loss {w @ loss:.4f}, error {w @ ((p > 0.5) != one[test]):.4f}, "
                      f"area under curve {roc_auc_score(one[test], p, sample_weight=w):.4f}", flush=True)


def main():
    paths = [path for path in sys.argv[1:] if path != "--choose"]
    names, x, one, weight, scenes = read(paths)
    print(f"{len(one)} pairs of {len(set(scenes))} scenes", file=sys.stderr)
    if len(paths) + 1 < len(sys.argv):
        choose(x, one, weight, scenes)
        return
    m = model().fit(x, one, sample_weight=weight)
    start = float(m._baseline_prediction.ravel()[0])  # scikit-learn has no public way to its trees
    trees = [complete(tree.nodes) for (tree,) in m._predictors]
    check(m, trees, start, x)
    print("// Made by tests/stages/import/train_joins.py of pairs that part_pairs wrote; not by hand.")
    print("// clang-format off\nconstexpr std::string_view clues[] = {")
    for name in names:
        print(f'    "{name}",')
    print(f"}};\nconstexpr int splits = {2 ** DEPTH - 1};\nusing Tree = TreeOf<splits>;")
    print(f"constexpr double start = {start:.5g};\nconstexpr Tree trees[] = {{")
    for feature, threshold, leaf in trees:
        rows = (map(str, feature), (f"{t:.7g}" for t in threshold), (f"{v:.3g}" for v in leaf))
        print("    {%s}," % ", ".join("{%s}" % ", ".join(row) for row in rows))
    print("};\n// clang-format on")


def check(m, trees, start, x):
    """What is written says what the model says, but for values that lie on a rounded threshold."""
    odds = np.full(len(x), start)
    rows = np.arange(len(x))
    for feature, threshold, leaf in trees:
        at = np.zeros(len(x), int)
        for _ in range(DEPTH):
            low = x[rows, np.array(feature)[at]] <= np.array(threshold)[at]
            at = 2 * at + np.where(low, 1, 2)
        odds += np.array(leaf)[at - len(feature)]
    assert np.mean(np.abs(odds - m.decision_function(x)) > 1e-3) < 1e-3


main()
