#pragma once
#include <optional>

#include "stages/import/table.h"

namespace geocage::stages {

/// The table among all that a sensor sees of a room: floor, walls, what stands on the floor. Planes are found
/// one after the other; seen from each, another plane that lies mostly beside what can stand on it is
/// background. What else hangs together, begins just above the plane and lies mostly over its outline stands
/// on it. Of the planes that carry something the nearest to the sensor is the table, but for the tops of
/// things that stand on one of them. Neither what hangs free over it stands there, seen through below, nor
/// what rises less than twice the sensor's noise. None where no plane carries anything, or where it is the
/// `largest` one of the cloud and nothing is background: then that is no room.
std::optional<FoundTable> table_in_room(const geometry::PointCloud& cloud, const FoundPlane& largest,
                                        const TableRule& rule);

}  // namespace geocage::stages
