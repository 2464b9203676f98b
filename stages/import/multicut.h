#pragma once
#include <functional>
#include <vector>

namespace geocage::stages {

/// An edge of a graph: what is lost when its ends lie in different parts; negative where they should.
struct Bond {
  int a, b;
  double weight;
};

/// A part for each of `nodes`, numbered from 0, so that the bonds between parts weigh little (minimum cost
/// multicut): greedy joining (Keuper et al. 2015, GAEC), then single nodes move while that helps. No join of
/// two parts and no move of a node to another or a new part makes it better. Nodes of a part hang together by
/// bonds. The optimum is not promised: the problem is NP-hard. O(nodes^2 bonds) at worst.
/// `may_join`, if there is one, is asked before two parts (their nodes) are joined, and may say no.
using MayJoin = std::function<bool(const std::vector<int>&, const std::vector<int>&)>;
std::vector<int> multicut(int nodes, const std::vector<Bond>& bonds, const MayJoin& may_join = {});

/// What the bonds between different parts weigh in all: smaller is better.
double cut_weight(const std::vector<int>& part, const std::vector<Bond>& bonds);

}  // namespace geocage::stages
