// What every reader promises about its result, whatever the bytes. Shared by the fuzz targets and their replay test.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string_view>

#include "ies/core/result.h"
#include "ies/photometry.h"
#include "tests/fuzz/require.h"

namespace gonio::ies::fuzz {

using gonio::fuzz::require;

inline void check_ascending(const std::vector<double>& angles, double low, double high) {
    require(angles.size() >= 2);
    for (std::size_t i = 0; i < angles.size(); ++i) {
        require(angles[i] >= low - 1e-12 && angles[i] <= high + 1e-12);
        require(i == 0 || angles[i] > angles[i - 1]);
    }
}

inline void check_web(const PhotometricWeb& web) {
    constexpr double kPi = std::numbers::pi;
    if (web.goniometer == Goniometer::type_c) {
        check_ascending(web.v_rad, 0.0, kPi);
        check_ascending(web.h_rad, 0.0, 2.0 * kPi);
        require(web.h_rad.front() == 0.0 && web.h_rad.back() == 2.0 * kPi);
    } else {
        check_ascending(web.v_rad, -kPi, kPi);
        check_ascending(web.h_rad, -kPi, kPi);
    }
    require(web.candela.size() == web.v_rad.size() * web.h_rad.size());
    for (const float value : web.candela) require(value >= 0.0F && value <= 1e12F);
    require(total_flux(web).in(lm) >= -1e-3 && std::isfinite(total_flux(web).in(lm)));
}

inline void check(const Result<Photometry>& result) {
    if (!result) {
        require(!result.error().code.empty() && !result.error().where.empty() && !result.error().message.empty());
        return;
    }
    check_web(result->web);
    require(result->diagnostics.size() < 100);
    for (const Diagnostic& diagnostic : result->diagnostics) {
        require(!diagnostic.code.empty() && diagnostic.line >= 1 && diagnostic.column >= 1);
        require(diagnostic.severity == "note" || diagnostic.severity == "warning");
    }
}

}  // namespace gonio::ies::fuzz
