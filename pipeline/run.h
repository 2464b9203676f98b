#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <string_view>

namespace geocage::pipeline {

/// All that a stage may touch besides its arguments. The base class keeps the metrics and says nothing, which
/// is what tests and library users want; the scheduler derives one that shows progress.
class Run {
 public:
  virtual ~Run() = default;
  virtual void log(std::string_view /*sentence*/) {}
  virtual void progress(std::size_t /*done*/, std::size_t /*total*/) {}
  virtual bool cancelled() const { return false; }

  /// A figure of this run, kept in the record beside the artefact. It must not depend on time, host or
  /// threads.
  void metric(std::string name, double value) { metrics_[std::move(name)] = value; }
  const std::map<std::string, double>& metrics() const { return metrics_; }

 private:
  std::map<std::string, double> metrics_;
};

}  // namespace geocage::pipeline
