#pragma once
#include <string>
#include <vector>

#include <Eigen/Core>

namespace geocage::reports {

/// Red, green, blue in linear light, 0..1.
using Colour = Eigen::Vector3d;

/// Lightness 0..1, chroma, hue in degrees of the OKLCh space (Ottosson 2020), with chroma lowered until the
/// colour exists on a screen.
Colour oklch(double lightness, double chroma, double hue_deg);

/// How numbers become colours. Both maps change by even steps of perceived difference.
struct Scale {
  enum class Map {
    sequential,
    diverging
  };  ///< dark violet to yellow; blue, pale, red with the middle at `(low+high)/2`
  Map map = Map::sequential;
  double low = 0, high = 1;

  Colour at(double value) const;  ///< ends beyond the range; grey for NaN
};

/// The smallest symmetric range about `middle`, or plain range, that holds all but `outliers` (a share) of
/// the values that are not NaN. [0, 1] when there is none.
Scale sequential_scale(std::vector<double> values, double outliers = 0.01);
Scale diverging_scale(std::vector<double> values, double middle, double outliers = 0.01);

double srgb(double linear);             ///< linear light to what a file holds, 0..1
std::string css(const Colour& colour);  ///< "#rrggbb"

}  // namespace geocage::reports
