#pragma once
#include <string>

namespace geocage::pipeline {

/// The name of this machine.
std::string host_name();

/// The present time as 2000-01-31T23:59:59Z.
std::string now_utc();

}  // namespace geocage::pipeline
