// Included once for each instruction set (see Highway's foreach_target.h).
#include <array>
#include <cstdint>

#include <hwy/highway.h>

#ifndef GEOCAGE_TOPOLOGY_PACKED_TABLE
#define GEOCAGE_TOPOLOGY_PACKED_TABLE
namespace geocage::topology {

/// Byte k of entry `bits`: which one its k-th bit is.
inline constexpr auto places_of_bits = [] {
  std::array<std::uint64_t, 256> table{};
  for (unsigned bits = 0; bits < 256; ++bits)
    for (unsigned lane = 0, k = 0; lane < 8; ++lane)
      if (bits >> lane & 1) table[bits] |= std::uint64_t{lane} << (8 * k++);
  return table;
}();

}  // namespace geocage::topology
#endif

#if defined(GEOCAGE_TOPOLOGY_PACKED_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef GEOCAGE_TOPOLOGY_PACKED_INL
#undef GEOCAGE_TOPOLOGY_PACKED_INL
#else
#define GEOCAGE_TOPOLOGY_PACKED_INL
#endif

HWY_BEFORE_NAMESPACE();
namespace geocage::topology {
namespace HWY_NAMESPACE {

/// The lanes in `mask` of 32-bit numbers, moved together to the low end; what is above them is anything.
/// Highway 1.0.3 has this for AVX2 too, but copies its table of 1 KB to the stack each time (g++ 12).
template <class D, class Vector, class Mask>
HWY_INLINE Vector packed([[maybe_unused]] D d, Vector v, Mask mask) {
#if HWY_TARGET == HWY_AVX2
  if constexpr (hwy::HWY_NAMESPACE::MaxLanes(D()) == 8) {
    namespace hn = hwy::HWY_NAMESPACE;
    std::uint8_t bits[8];
    hn::StoreMaskBits(d, mask, bits);
    const hn::Rebind<std::uint8_t, D> bytes;
    const hn::RebindToSigned<D> whole;
    const auto places = hn::LoadU(bytes, reinterpret_cast<const std::uint8_t*>(&places_of_bits[bits[0]]));
    return hn::TableLookupLanes(v, hn::IndicesFromVec(d, hn::PromoteTo(whole, places)));
  }
#endif
  return hwy::HWY_NAMESPACE::Compress(v, mask);
}

}  // namespace HWY_NAMESPACE
}  // namespace geocage::topology
HWY_AFTER_NAMESPACE();
#endif
