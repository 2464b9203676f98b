#!/usr/bin/env python3
"""Learns from pairs of parts which are one thing (python3-sklearn):
  train_joins.py TRAINING.csv [TEST.csv] > stages/import/join_trees.inc
Boosted regression trees of depth 3, written as complete trees: split n sends what is at most its threshold to
2 n + 1, the rest to 2 n + 2."""
import csv
import sys

import numpy as np
from sklearn.ensemble import GradientBoostingClassifier
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import GroupKFold

TREES, DEPTH, RATE = 200, 3, 0.1


def read(path):
    with open(path) as file:
        rows = list(csv.reader(file))
    names = rows[0][4:]
    data = np.array([[float(v) for v in row[1:]] for row in rows[1:]])
    scenes = np.array([row[0].rsplit("-", 1)[0] for row in rows[1:]])
    x, one = data[:, 3:].astype(np.float32), data[:, 0].astype(int)  # as the trees read them
    # A wrong join of large parts costs a thing, of crumbs nothing; each scene counts alike.
    weight = np.clip(data[:, 1] / 600, 0.05, 1)
    for scene in set(scenes):
        here = scenes == scene
        weight[here] /= weight[here].sum() ** 0.5
    return names, x, one, weight, scenes


def model():
    return GradientBoostingClassifier(n_estimators=TREES, max_depth=DEPTH, learning_rate=RATE, subsample=0.7,
                                      min_samples_leaf=20, max_features=0.5, random_state=1)


def complete(tree):
    """Features, thresholds and leaves of a tree, padded to its full depth."""
    feature, threshold, leaf = [0] * (2 ** DEPTH - 1), [0.0] * (2 ** DEPTH - 1), [0.0] * 2 ** DEPTH

    def fill(node, at):
        if at >= 2 ** DEPTH - 1:
            leaf[at - 2 ** DEPTH + 1] = tree.value[node, 0, 0]
        elif tree.children_left[node] < 0:
            fill(node, 2 * at + 1)
            fill(node, 2 * at + 2)
        else:
            feature[at], threshold[at] = tree.feature[node], tree.threshold[node]
            fill(tree.children_left[node], 2 * at + 1)
            fill(tree.children_right[node], 2 * at + 2)

    fill(0, 0)
    return feature, threshold, leaf


def main():
    names, x, one, weight, scenes = read(sys.argv[1])
    folds = []
    for train, test in GroupKFold(5).split(x, one, scenes):
        m = model().fit(x[train], one[train], sample_weight=weight[train])
        p = m.predict_proba(x[test])[:, 1]
        wrong = (p > 0.5) != one[test]
        folds.append((roc_auc_score(one[test], p, sample_weight=weight[test]),
                      (weight[test] * wrong).sum() / weight[test].sum()))
    print(f"{len(one)} pairs; 5 folds: area under curve, weighted error:", np.mean(folds, axis=0),
          file=sys.stderr)
    m = model().fit(x, one, sample_weight=weight)
    for k in np.argsort(-m.feature_importances_)[:40]:
        print(f"{names[k]:14s} {m.feature_importances_[k]:.3f}", file=sys.stderr)
    if len(sys.argv) > 2:
        _, x2, one2, w2, _ = read(sys.argv[2])
        p = m.predict_proba(x2)[:, 1]
        print("test: area, error:", roc_auc_score(one2, p, sample_weight=w2),
              (w2 * ((p > 0.5) != one2)).sum() / w2.sum(), file=sys.stderr)
    start = m.init_.class_prior_[1]
    start = np.log(start / (1 - start))
    trees = [complete(tree.tree_) for (tree,) in m.estimators_]
    check(m, trees, start, x)
    print("// Made by tests/stages/import/train_joins.py of pairs that part_pairs wrote; not by hand.")
    print(f"// clang-format off\nconstexpr double start = {start:.5g};\nconstexpr Tree trees[] = {{")
    for feature, threshold, leaf in trees:
        rows = (map(str, feature), (f"{t:.5g}" for t in threshold), (f"{RATE * v:.4g}" for v in leaf))
        print("    {%s}," % ", ".join("{%s}" % ", ".join(row) for row in rows))
    print("};\n// clang-format on")


def check(m, trees, start, x):
    """What is written says what the model says."""
    odds = np.full(len(x), start)
    rows = np.arange(len(x))
    for feature, threshold, leaf in trees:
        at = np.zeros(len(x), int)
        for _ in range(DEPTH):
            low = x[rows, np.array(feature)[at]] <= np.array(threshold)[at]
            at = 2 * at + np.where(low, 1, 2)
        odds += RATE * np.array(leaf)[at - len(feature)]
    assert np.abs(odds - m.decision_function(x)).max() < 1e-3


main()
