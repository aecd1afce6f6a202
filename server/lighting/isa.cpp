#include "server/lighting/isa.h"

#include <hwy/highway.h>
#include <hwy/targets.h>

#include "server/trace/embree_isa.h"

namespace gonio::lighting {
namespace {

// Highway's AVX3 is AVX-512 F, BW, CD, DQ and VL; AVX3_DL has more of it.
constexpr std::int64_t kAvx512 = HWY_AVX3 | HWY_AVX3_DL;

}  // namespace

Result<bool> use_isa(const std::string& name) {
    if (name == "auto") return true;
    const std::int64_t has = hwy::SupportedTargets();
    const bool wide = name == "avx512";
    if ((wide && (has & kAvx512) == 0) || (!wide && (has & (kAvx512 | HWY_AVX2)) == 0))
        return Error{"unsupported", "--isa", name, "This machine has not this instruction set."};
    if (!wide) hwy::DisableTargets(kAvx512);
    trace::set_embree_isa(name);
    return true;
}

std::string isa_in_use() {
    const std::int64_t has = hwy::SupportedTargets() & HWY_TARGETS;
    const std::int64_t best = has & -has;  // Highway's best has the lowest bit
    switch (best) {
        case HWY_AVX3_DL:
        case HWY_AVX3:
            return "avx512";
        case HWY_AVX2:
            return "avx2";
        default:
            return hwy::TargetName(best);
    }
}

}  // namespace gonio::lighting
