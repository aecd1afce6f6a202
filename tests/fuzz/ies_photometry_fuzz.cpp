// Any bytes through everything that follows a successful read: quantities, solid, curves, and a round trip through the
// writers.
#include <algorithm>

#include "ies/curves.h"
#include "ies/eulumdat.h"
#include "ies/photometry_file.h"
#include "ies/quantities.h"
#include "ies/solid.h"
#include "ies/tm33.h"
#include "ies/writers.h"
#include "tests/fuzz/ies_fuzz_check.h"

namespace gonio::ies::fuzz {
namespace {

void check_derived(const Photometry& photometry) {
    const Quantities q = quantities(photometry);
    require(std::isfinite(q.total.in(lm)) && std::isfinite(q.peak.in(cd)));
    double zonal = 0.0;
    for (const LuminousFlux& flux : q.zonal) zonal += flux.in(lm);
    require(std::abs(zonal - q.total.in(lm)) <= 1e-3 * std::abs(q.total.in(lm)) + 1e-3);
    const SolidMesh mesh = photometric_solid(photometry.web, Angle::degrees(15.0));
    for (const float component : mesh.normals) require(std::isfinite(component));
    for (const std::uint32_t index : mesh.triangles) require(3u * std::size_t{index} < mesh.positions.size());
    require(!curves_svg(photometry, "title").empty() && !curves_text(photometry).empty());
}

void check_round_trip(const Photometry& photometry) {
    const Result<Photometry> lm63 = read_lm63(write_lm63(photometry));
    check(lm63);
    require(lm63.ok());
    const bool type_c = photometry.web.goniometer == Goniometer::type_c;
    if (type_c) require(lm63->web.candela == photometry.web.candela);
    const Result<Photometry> eulumdat = read_eulumdat(write_eulumdat(photometry));
    check(eulumdat);
    require(eulumdat.ok());
    const Result<Photometry> tm33 = read_tm33(write_tm33(photometry));
    check(tm33);
    require(tm33.ok());
}

}  // namespace
}  // namespace gonio::ies::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace gonio::ies;
    const auto photometry = read_photometry({reinterpret_cast<const char*>(data), size});
    fuzz::check(photometry);
    // Types A and B go through a half-degree resampling: too slow for every input.
    const bool quick = photometry && (photometry->web.goniometer == Goniometer::type_c || size % 16 == 0);
    if (!quick) return 0;
    fuzz::check_derived(*photometry);
    fuzz::check_round_trip(*photometry);
    return 0;
}
