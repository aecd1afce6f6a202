// Webs whose angles lie closer than lighting can tell apart.
#include <algorithm>
#include <span>

#include "ies/fold.h"

namespace gonio::ies {
namespace {

// Result: which angles stay: one in each step, and those before a longer one.
std::vector<std::size_t> kept_angles(const std::vector<double>& angles, double step) {
    const double least = step * (1.0 - 1e-6);
    std::vector<std::size_t> kept = {0};
    for (std::size_t i = 1; i < angles.size(); ++i) {
        if (i + 1 == angles.size() || angles[i] - angles[kept.back()] >= least || angles[i + 1] - angles[i] >= least)
            kept.push_back(i);
    }
    return kept;
}

std::vector<double> values_at(const std::vector<double>& values, const std::vector<std::size_t>& indices) {
    std::vector<double> result;
    result.reserve(indices.size());
    for (const std::size_t i : indices) result.push_back(values[i]);
    return result;
}

// out: the intensities at the angles that stay, of a linear function of all of them: where some beside it are left out
// its mean to the middle of what stays.
void take_means(const std::vector<double>& angles, const std::vector<std::size_t>& kept, std::span<const float> from,
                std::vector<double>& integral, std::vector<float>& out) {
    integral.assign(1, 0.0);
    for (std::size_t i = 1; i < angles.size(); ++i)
        integral.push_back(integral.back() + 0.5 * (angles[i] - angles[i - 1]) *
                                                 (static_cast<double>(from[i - 1]) + static_cast<double>(from[i])));
    const auto until = [&](double x, std::size_t from_index) {
        std::size_t i = std::min(from_index, angles.size() - 2);
        while (i + 2 < angles.size() && angles[i + 1] <= x) ++i;
        const double along = x - angles[i], slope = (static_cast<double>(from[i + 1]) - static_cast<double>(from[i])) /
                                                    (angles[i + 1] - angles[i]);
        return integral[i] + along * (static_cast<double>(from[i]) + 0.5 * along * slope);
    };
    out.clear();
    for (std::size_t k = 0; k < kept.size(); ++k) {
        const std::size_t i = kept[k], before = k > 0 ? kept[k - 1] : i, after = k + 1 < kept.size() ? kept[k + 1] : i;
        const double low = i - before > 1 ? 0.5 * (angles[before] + angles[i]) : angles[i],
                     high = after - i > 1 ? 0.5 * (angles[i] + angles[after]) : angles[i];
        out.push_back(low < high ? static_cast<float>(std::max(0.0, until(high, i) - until(low, before)) / (high - low))
                                 : from[i]);
    }
}

}  // namespace

std::optional<PhotometricWeb> thinned(const PhotometricWeb& web, Angle v_step, Angle h_step) {
    const std::vector<std::size_t> kept_v = kept_angles(web.v_rad, v_step.radians()),
                                   kept_h = kept_angles(web.h_rad, h_step.radians());
    if (kept_v.size() == web.v_rad.size() && kept_h.size() == web.h_rad.size()) return std::nullopt;
    PhotometricWeb thin{web.goniometer, values_at(web.v_rad, kept_v), values_at(web.h_rad, kept_h), {}};
    const std::size_t n_v = kept_v.size(), n_h = web.h_rad.size();
    std::vector<double> integral;
    std::vector<float> row, out;
    std::vector<float> over_v;  // thin in v alone
    over_v.reserve(n_h * n_v);
    for (std::size_t h = 0; h < n_h; ++h) {
        take_means(web.v_rad, kept_v, detail::column(web, h), integral, out);
        over_v.insert(over_v.end(), out.begin(), out.end());
    }
    thin.candela.resize(kept_h.size() * n_v);
    for (std::size_t v = 0; v < n_v; ++v) {
        row.clear();
        for (std::size_t h = 0; h < n_h; ++h) row.push_back(over_v[h * n_v + v]);
        take_means(web.h_rad, kept_h, row, integral, out);
        // The planes at 0 and at 2 pi are one.
        if (web.goniometer == Goniometer::type_c) out.front() = out.back() = 0.5f * (out.front() + out.back());
        for (std::size_t h = 0; h < out.size(); ++h) thin.candela[h * n_v + v] = out[h];
    }
    const double wanted = total_flux(web).in(lm), found = total_flux(thin).in(lm);
    if (found > 0.0)
        for (float& candela : thin.candela)
            candela = static_cast<float>(static_cast<double>(candela) * (wanted / found));
    return thin;
}

}  // namespace gonio::ies
