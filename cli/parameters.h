#pragma once
#include <string>
#include <vector>

#include "pipeline/settings.h"
#include "stages/accuracy/accuracy.h"
#include "stages/agreement/agreement.h"
#include "stages/approach/approach.h"
#include "stages/balls/balls.h"
#include "stages/cage/cage.h"
#include "stages/clearance/clearance.h"
#include "stages/cloud/cloud.h"
#include "stages/evaluate/evaluate.h"
#include "stages/field/field.h"
#include "stages/import/import.h"
#include "stages/noise/noise.h"
#include "stages/occupancy/occupancy.h"
#include "stages/place/place.h"
#include "stages/reconstruct/reconstruct.h"
#include "stages/remesh/remesh.h"
#include "stages/scan/scan.h"
#include "stages/score/score.h"

namespace geocage::cli {

/// The parameters of every stage, for one object and one variant.
struct StageParameters {
  stages::ImportParams import;
  stages::ScanParams scan;
  stages::CloudParams cloud;
  stages::OccupancyParams occupancy;
  stages::ClearanceParams clearance;
  stages::ReconstructParams reconstruct;
  stages::RemeshParams remesh;
  stages::NoiseParams noise;
  stages::AccuracyParams accuracy;
  stages::FieldParams field;
  stages::BallsParams balls;
  stages::ScoreParams score;
  stages::AgreementParams agreement;
  stages::PlaceParams place;
  stages::ApproachParams approach;
  stages::EvaluateParams evaluate;
  stages::CageParams cage;
};

/// The one list of stages, in the order of the dataflow: visit(name, version, what it does, its parameters).
template <class Visit>
void for_each_stage(StageParameters& p, Visit visit) {
  visit("import", stages::import_mesh_stage.version, "reads a foreign mesh or cloud in a worker process",
        p.import);
  visit("scan", stages::scan_stage.version, "sees a mesh with a virtual depth camera", p.scan);
  visit("cloud", stages::cloud_stage.version, "drops outliers, thins, orients normals", p.cloud);
  visit("occupancy", stages::occupancy_stage.version, "free, occupied and unknown space from the rays",
        p.occupancy);
  visit("clearance", stages::clearance_stage.version, "distance to what the rays met, for planning",
        p.clearance);
  visit("reconstruct", stages::reconstruct_stage.version, "a closed surface from oriented points",
        p.reconstruct);
  visit("remesh", stages::remesh_stage.version, "near-equilateral triangles of one size", p.remesh);
  visit("noise", stages::noise_stage.version, "moves the mesh's vertices, to see what scores are worth",
        p.noise);
  visit("accuracy", stages::accuracy_stage.version, "distances of a surface from the true one", p.accuracy);
  visit("field", stages::field_stage.version, "signed distance to the surface", p.field);
  visit("balls", stages::balls_stage.version, "geodesic ball of every vertex and what it says", p.balls);
  visit("score", stages::score_stage.version, "where to place a hand: winding angle, total curvature",
        p.score);
  visit("agreement", stages::agreement_stage.version, "compares noisy scores with clean ones", p.agreement);
  visit("place", stages::place_stage.version, "places the hand at the best scores and closes it", p.place);
  visit("approach", stages::approach_stage.version, "plans the way to each grasp", p.approach);
  visit("evaluate", stages::evaluate_stage.version, "pushes the object in the closing hand", p.evaluate);
  visit("cage", stages::cage_stage.version, "looks for ways out of the locked hand, without friction",
        p.cage);
}

std::vector<std::string> stage_names();

/// Fields of one stage of `parameters`, which they point into. UserError (configuration) for an unknown
/// stage.
pipeline::Fields fields_of_stage(StageParameters& parameters, const std::string& stage);

/// Puts every setting in its place; mistakes are added as lines.
void apply_all(const std::vector<pipeline::Setting>& settings, StageParameters& parameters,
               std::vector<std::string>& mistakes);

}  // namespace geocage::cli
