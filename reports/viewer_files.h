#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "reports/pair_page.h"
#include "reports/report.h"

namespace geocage::reports {

/// The pages' scripts beside the program: app.js, scene.js, plots.js, app.css. False when they were not
/// built.
bool viewer_is_built(const std::filesystem::path& viewer);

/// What the pages load: data/*.js register themselves (`geocage.put(name, text)`), since a page opened from
/// disk may not fetch. Objects and hands are glTF files, shared by all grasps that show them; all is zlib and
/// base64. Fills `folder` with index.html, viewer/, data/ and a small picture a grasp in pictures/.
/// Precondition: viewer_is_built(input.viewer). Errors: as write_report.
void write_viewer(const ReportInput& input, const std::vector<PairResults>& pairs,
                  const std::vector<std::vector<Figure>>& figures, const std::filesystem::path& folder);

/// The report in `folder` as one HTML file with everything inside; answers its path, report.html.
/// Precondition: write_viewer has filled the folder.
std::filesystem::path write_single_file(const std::filesystem::path& folder);

/// An object with its fields, cloud and known-occupied cells, as glTF. `columns`: one set of fields a hand.
std::vector<std::uint8_t> object_glb(const topology::Scores& scores, const geometry::PointCloud* cloud,
                                     const std::filesystem::path& occupancy);
/// A hand's links as nodes, each with its capsules, in the open posture; `extras` of the root hold its
/// joints.
std::vector<std::uint8_t> hand_glb(const hands::Hand& hand);
/// Object and hand in one scene, the hand in its first grasp; its way to it, where there is one, is the
/// animation "approach", and the closing "close".
std::vector<std::uint8_t> pair_glb(const PairResults& pair, const std::vector<hands::Hand>& hands);

}  // namespace geocage::reports
