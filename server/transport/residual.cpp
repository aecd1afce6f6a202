#include "server/transport/residual.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/transport/residual.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace gonio::transport {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Compares all four channels at once, or one after the other on a machine without vectors.
void Compare(const glm::vec4* e, const glm::vec4* f, std::size_t size, const glm::vec4& floor, glm::vec4* r,
             Residual& found) {
    using Four = hn::CappedTag<float, 4>;
    constexpr std::size_t kStep = HWY_TARGET == HWY_SCALAR ? 1 : 4;
    const Four four;
    using V = hn::Vec<Four>;
    // A value that is not a number must not pass for a small one, neither now nor later.
    const auto greater = [](V a, V b) { return hn::IfThenElse(hn::Or(hn::Ge(a, b), hn::IsNaN(a)), a, b); };
    for (std::size_t channel = 0; channel < 4; channel += kStep) {
        V most = hn::Zero(four), greatest = most, relative = most, change = most, sum = most;
        const V least = hn::LoadU(four, &floor[0] + channel);
        for (std::size_t i = 0; i < size; ++i) {
            const V after = hn::LoadU(four, &f[i][0] + channel),
                    by = hn::Sub(after, hn::LoadU(four, &e[i][0] + channel)), off = hn::Abs(by);
            hn::StoreU(by, four, &r[i][0] + channel);
            most = greater(most, off);
            greatest = hn::Max(greatest, after);
            relative = greater(relative, hn::Div(off, hn::Add(after, least)));
            change = hn::Add(change, off);
            sum = hn::Add(sum, after);
        }
        hn::StoreU(most, four, &found.most[0] + channel);
        hn::StoreU(greatest, four, &found.greatest[0] + channel);
        hn::StoreU(relative, four, &found.relative[0] + channel);
        hn::StoreU(change, four, &found.change[0] + channel);
        hn::StoreU(sum, four, &found.sum[0] + channel);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace gonio::transport
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gonio::transport {

HWY_EXPORT(Compare);

Residual compare(std::span<const glm::vec4> e, std::span<const glm::vec4> f, const glm::vec3& floor,
                 std::span<glm::vec4> r) {
    Residual found;
    HWY_DYNAMIC_DISPATCH(Compare)(e.data(), f.data(), f.size(), glm::vec4(floor, 1.0f), r.data(), found);
    return found;
}

}  // namespace gonio::transport
#endif
