#pragma once
#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace geocage::datasets {

using geometry::TriangleMesh;
using geometry::Vec3;

// Analytic shapes, the oracles of tests. Centred at the origin of O, axis z, metres;
// closed and outward unless said otherwise. The same arguments always give the same bytes. V and A are those
// of the smooth shape; an inscribed polyhedron is smaller by O(1 / n^2).

/// Regular solids with edge length 1 m. V = sqrt(2)/12, 1, sqrt(2)/3, 5 (3 + sqrt 5)/12.
TriangleMesh tetrahedron();
TriangleMesh cube();
TriangleMesh octahedron();
TriangleMesh icosahedron();

/// Box with sides `size_m`, each of them cut into `cells`. V = xyz.
TriangleMesh box(const Vec3& size_m, int cells = 1);

/// Icosahedron whose triangles are cut into four `subdivisions` times, on the sphere. 20 * 4^n triangles.
/// V = 4/3 pi r^3, A = 4 pi r^2.
TriangleMesh icosphere(double radius_m, int subdivisions);

/// Tube of radius r around a circle of radius R > r: nu points along the circle, nv around the tube. Euler
/// number 0. V = 2 pi^2 R r^2, A = 4 pi^2 R r; Gauss curvature cos v / (r (R + r cos v)).
TriangleMesh torus(double ring_radius_m, double tube_radius_m, int nu, int nv);

/// Two such tori side by side along x, mirror images in the plane x = 0, joined by a three-sided tube where
/// they are nearest. Genus 2.
TriangleMesh double_torus(double ring_radius_m, double tube_radius_m, int nu, int nv);

/// Closed cylinder, `around` points a circle, rows as far apart as these points; its caps are fans of rings.
/// The polyhedron itself has V = n/2 sin(2 pi/n) r^2 h.
TriangleMesh capped_cylinder(double radius_m, double height_m, int around);

/// The mantle of that cylinder alone in `along` rows: open, two boundary loops, Euler number 0.
TriangleMesh open_tube(double radius_m, double height_m, int around, int along);

/// Flat square in the plane z = 0, normals +z, cells x cells x 2 triangles: open, Euler number 1.
TriangleMesh flat_grid(double side_m, int cells);

/// A mug without its handle: bottom at z = 0, wall and bottom `wall_m` thick; closed, of genus 0.
/// The polyhedron itself has V = n/2 sin(2 pi/n) (r^2 h - (r - w)^2 (h - w)).
TriangleMesh cup(double radius_m, double height_m, double wall_m, int around);

/// Two balls of radius R with centres `apart_m` apart along z, joined by a bar of radius r < R. With
/// d = sqrt(R^2 - r^2) and the cap C = pi (R - d)^2 (2 R + d) / 3 that each ball loses,
/// V = 2 (4/3 pi R^3 - C) + pi r^2 (apart - 2 d). Genus 0, a waist. Precondition: apart > 2 d.
TriangleMesh dumbbell(double ball_radius_m, double bar_radius_m, double apart_m, int around);

/// A cylinder (radius R, height h, bottom at z = 0) with a neck (radius r < R, length n) on its top that ends
/// in a ball (radius k > r). V = pi R^2 h + pi r^2 n + 4/3 pi k^3 - C, with the cap C of k and r as above.
/// Genus 0, a knob.
TriangleMesh knobbed_cylinder(double radius_m, double height_m, double neck_radius_m, double neck_m,
                              double knob_radius_m, int around);

/// Half a hollow ball with a flat rim, open upwards; lowest point at z = -R. V = 2/3 pi (R^3 - (R - w)^3).
/// Genus 0.
TriangleMesh bowl(double radius_m, double wall_m, int around);

/// A square ring in the plane y = 0 on a bar along -z, both of square section, made of cubes: the ring's
/// outer side is 10 cells, its hole 6, its section 2 x 2; the bar is 16 cells long. V = 192 cell^3, genus 1.
TriangleMesh ring_on_bar(double cell_m);

/// A shape by its name and sizes, as the catalogue gives them: `sphere` r, `torus` R r, `cylinder` r h, `cup`
/// r h w, `dumbbell` R r apart, `knobbed_cylinder` R h r n k, `bowl` R w, `ring_on_bar` cell, `box` x y z; in
/// metres, finely meshed. Errors: UserError (configuration) for an unknown name, another number of sizes, or
/// sizes that give no such shape.
TriangleMesh make_shape(const std::string& name, const std::vector<double>& size_m);

}  // namespace geocage::datasets
