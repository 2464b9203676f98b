// The geodesic ball of a vertex by hops: as many edges as fit in the radius, each as long as the mean edge (thesis 3.3).

export interface Links { start: Uint32Array; items: Uint32Array }

/** Neighbours of each vertex, in compressed rows. */
export function linksOf(triangles: ArrayLike<number>, vertices: number): Links {
  const edges = new Set<number>();
  const degree = new Uint32Array(vertices + 1);
  const each = (visit: (a: number, b: number) => void) => {
    for (let i = 0; i < triangles.length; i += 3)
      for (let k = 0; k < 3; ++k) visit(triangles[i + k], triangles[i + ((k + 1) % 3)]);
  };
  const pairs: number[] = [];
  each((a, b) => {
    const key = Math.min(a, b) * vertices + Math.max(a, b);
    if (edges.has(key)) return;
    edges.add(key);
    pairs.push(a, b);
    ++degree[a + 1], ++degree[b + 1];
  });
  for (let v = 0; v < vertices; ++v) degree[v + 1] += degree[v];
  const start = degree, items = new Uint32Array(pairs.length), next = start.slice();
  for (let i = 0; i < pairs.length; i += 2) {
    items[next[pairs[i]]++] = pairs[i + 1];
    items[next[pairs[i + 1]]++] = pairs[i];
  }
  return { start, items };
}

/** Distances are whole hops; the slack is that of topology/lane_balls.cpp. */
export function ballByHops(links: Links, vertex: number, radius: number, hop: number): number[] {
  const most = hop > 0 ? Math.floor((radius * (1 + 1e-9)) / hop) : 0;
  const seen = new Uint8Array(links.start.length - 1);
  let ring = [vertex];
  const all = [vertex];
  seen[vertex] = 1;
  for (let k = 0; k < most && ring.length > 0; ++k) {
    const next: number[] = [];
    for (const v of ring)
      for (let i = links.start[v]; i < links.start[v + 1]; ++i) {
        const w = links.items[i];
        if (seen[w]) continue;
        seen[w] = 1;
        next.push(w);
      }
    all.push(...next);
    ring = next;
  }
  return all;
}
