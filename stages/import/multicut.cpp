#include "stages/import/multicut.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace geocage::stages {

namespace {

using Neighbours = std::vector<std::map<int, double>>;  // of each node: the others' summed weights

Neighbours neighbours_of(int nodes, const std::vector<Bond>& bonds) {
  Neighbours near(static_cast<std::size_t>(nodes));
  for (const Bond& bond : bonds) {
    if (bond.a == bond.b) continue;
    near[bond.a][bond.b] += bond.weight;
    near[bond.b][bond.a] += bond.weight;
  }
  return near;
}

std::vector<int> nodes_of(const std::vector<int>& part, int name) {
  std::vector<int> nodes;
  for (std::size_t v = 0; v < part.size(); ++v)
    if (part[v] == name) nodes.push_back(static_cast<int>(v));
  return nodes;
}

/// Joins parts by the heaviest bond between two, as long as one weighs more than nothing.
bool join(std::vector<int>& part, const Neighbours& near, const MayJoin& may_join) {
  Neighbours between(near.size());  // parts
  for (std::size_t v = 0; v < near.size(); ++v)
    for (const auto& [w, weight] : near[v])
      if (part[v] != part[w]) between[part[v]][part[w]] += weight;
  bool joined = false;
  for (;;) {
    int a = -1, b = -1;
    double most = 1e-12;
    for (std::size_t p = 0; p < between.size(); ++p)
      for (const auto& [q, weight] : between[p])
        if (weight > most) {
          most = weight;
          a = static_cast<int>(p);
          b = q;
        }
    if (a < 0) return joined;
    if (may_join && !may_join(nodes_of(part, a), nodes_of(part, b))) {
      between[a][b] = between[b][a] = 0;
      continue;
    }
    joined = true;
    std::replace(part.begin(), part.end(), b, a);
    for (const auto& [q, weight] : between[b]) {
      between[q].erase(b);
      if (q == a) continue;
      between[a][q] += weight;
      between[q][a] += weight;
    }
    between[b].clear();
  }
}

/// Moves single nodes to the part where they hold most, or to one of their own.
bool move(std::vector<int>& part, const Neighbours& near) {
  bool moved = false;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t v = 0; v < near.size(); ++v) {
      std::map<int, double> hold;
      hold[part[v]] = 0;
      for (const auto& [w, weight] : near[v]) hold[part[w]] += weight;
      int best = part[v];
      double most = hold[best] + 1e-12;
      for (const auto& [p, weight] : hold)
        if (weight > most) {
          most = weight;
          best = p;
        }
      if (most < -1e-12 && best == part[v]) {  // an empty part's name, if there is one
        std::vector<char> used(near.size(), 0);
        for (int p : part) used[p] = 1;
        const auto empty = std::find(used.begin(), used.end(), 0);
        if (empty != used.end()) best = static_cast<int>(empty - used.begin());
      }
      if (best == part[v]) continue;
      part[v] = best;
      changed = moved = true;
    }
  }
  return moved;
}

/// Parts that don't hang together become several: the weight of the cut stays.
std::vector<int> connected(const std::vector<int>& part, const Neighbours& near) {
  std::vector<int> out(part.size(), -1);
  int count = 0;
  for (std::size_t start = 0; start < part.size(); ++start) {
    if (out[start] >= 0) continue;
    std::vector<int> todo = {static_cast<int>(start)};
    out[start] = count;
    while (!todo.empty()) {
      const int v = todo.back();
      todo.pop_back();
      for (const auto& [w, weight] : near[v])
        if (out[w] < 0 && part[w] == part[v]) {
          out[w] = count;
          todo.push_back(w);
        }
    }
    ++count;
  }
  return out;
}

}  // namespace

double cut_weight(const std::vector<int>& part, const std::vector<Bond>& bonds) {
  double sum = 0;
  for (const Bond& bond : bonds)
    if (part[bond.a] != part[bond.b]) sum += bond.weight;
  return sum;
}

std::vector<int> multicut(int nodes, const std::vector<Bond>& bonds, const MayJoin& may_join) {
  const Neighbours near = neighbours_of(nodes, bonds);
  std::vector<int> part(static_cast<std::size_t>(nodes));
  std::iota(part.begin(), part.end(), 0);
  join(part, near, may_join);
  while (move(part, near) && join(part, near, may_join)) {
  }
  return connected(part, near);
}

}  // namespace geocage::stages
