// What a file's numbers say that cannot be meant so.
#pragma once

#include <cstddef>

#include "ies/photometry.h"
#include "ies/text_scan.h"

namespace gonio::ies::detail {

// Sets provenance.radiometric. Warns of it and of more than kMostOutputRatio times the rated lumens. total: the web's
// flux. offset: where the lumens stand in the file.
void check_plausible(Photometry& photometry, LuminousFlux total, std::size_t offset, Report& report);

// Flux / rated lumens. Measured ratios of luminaires are at most 1; of rounded lumens somewhat more.
inline constexpr double kMostOutputRatio = 1.05;

}  // namespace gonio::ies::detail
