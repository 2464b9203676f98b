#pragma once
#include <concepts>
#include <filesystem>
#include <string_view>

namespace geocage::pipeline {

/// A type that can lie in the store. Its room declares, beside the type:
///   std::string_view artefact_kind(const T*);                        e.g. "mesh"
///   void save_artefact(const T&, const std::filesystem::path& dir);  files that common tools open
///   void load_artefact(T&, const std::filesystem::path& dir);        exact inverse of save
/// Equal values save equal bytes: no times, hosts, paths.
template <class T>
concept Artefact = std::default_initializable<T> && requires(T& value, const std::filesystem::path& dir) {
  { artefact_kind(static_cast<const T*>(nullptr)) } -> std::convertible_to<std::string_view>;
  save_artefact(value, dir);
  load_artefact(value, dir);
};

}  // namespace geocage::pipeline
