#include "ies/grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::ies::detail {

namespace {

constexpr double kSameAngleDeg = 1e-3;  // finer than any goniometer's scale
// Angles are kept to this, so that writing and reading again finds the same ones.
constexpr double kAngleUnitDeg = 1e-9;
constexpr double kMinStepDeg = 1e-6;     // angles closer than this count as equal: every cell keeps a finite slope
constexpr float kMismatchRatio = 1e-3F;  // of the peak; below it two planes count as equal

bool same_angle(double a, double b) {
    return std::abs(a - b) < kSameAngleDeg;
}
bool multiple_of_90(double a) {
    return same_angle(a, 90.0 * std::round(a / 90.0));
}
double radians(double degrees) {
    return Angle::degrees(degrees).radians();
}

// Index of the first angle that breaks the order set by the first two; 0 if none does.
std::size_t order_break(const std::vector<double>& angles) {
    for (std::size_t i = 1; i < angles.size(); ++i) {
        const bool ascending = angles[1] > angles[0];
        const double step = ascending ? angles[i] - angles[i - 1] : angles[i - 1] - angles[i];
        if (!(step >= kMinStepDeg - 0.5 * kAngleUnitDeg)) return i;
    }
    return 0;
}

std::optional<GridFault> find_fault(const FileGrid& grid) {
    const bool type_c = grid.goniometer == Goniometer::type_c;
    const bool v_is_latitude = grid.goniometer == Goniometer::type_a;
    const bool h_is_latitude = grid.goniometer == Goniometer::type_b;
    const double v_min = type_c ? 0.0 : v_is_latitude ? -90.0 : -180.0;
    const double v_max = v_is_latitude ? 90.0 : 180.0;
    const double h_max = type_c ? 360.0 : h_is_latitude ? 90.0 : 180.0;
    const auto check = [](const std::vector<double>& angles, double low, double high,
                          bool vertical) -> std::optional<GridFault> {
        for (std::size_t i = 0; i < angles.size(); ++i) {
            if (angles[i] < low || angles[i] > high) {
                return GridFault{"angle_out_of_range", "the angle lies outside the range of this photometric type",
                                 vertical, i};
            }
        }
        if (const std::size_t i = order_break(angles)) {
            return GridFault{"angles_not_monotone", "the angles neither ascend nor descend throughout", vertical, i};
        }
        return std::nullopt;
    };
    if (auto fault = check(grid.v_deg, v_min, v_max, true)) return fault;
    if (!grid.planes.empty()) return std::nullopt;
    if (auto fault = check(grid.h_deg, -h_max, h_max, false)) return fault;
    if (std::abs(grid.h_deg.back() - grid.h_deg.front()) > 360.0 + kSameAngleDeg) {
        return GridFault{"angle_out_of_range", "the angles span more than a turn", false, grid.h_deg.size() - 1};
    }
    return std::nullopt;
}

void make_ascending(FileGrid& grid, Report& report) {
    const std::size_t nv = grid.v_deg.size();
    const std::size_t nh = grid.candela.size() / nv;
    if (nv > 1 && grid.v_deg[1] < grid.v_deg[0]) {
        report.warn("v_descending", grid.v_offset, "the vertical angles descend; the order was turned round");
        std::reverse(grid.v_deg.begin(), grid.v_deg.end());
        for (std::size_t h = 0; h < nh; ++h) {
            const auto column = grid.candela.begin() + static_cast<std::ptrdiff_t>(h * nv);
            std::reverse(column, column + static_cast<std::ptrdiff_t>(nv));
        }
    }
    if (grid.h_deg.size() > 1 && grid.h_deg[1] < grid.h_deg[0]) {
        report.warn("h_descending", grid.h_offset, "the horizontal angles descend; the order was turned round");
        std::reverse(grid.h_deg.begin(), grid.h_deg.end());
        for (std::size_t h = 0; h < nh / 2; ++h) {
            const auto a = grid.candela.begin() + static_cast<std::ptrdiff_t>(h * nv);
            const auto b = grid.candela.begin() + static_cast<std::ptrdiff_t>((nh - 1 - h) * nv);
            std::swap_ranges(a, a + static_cast<std::ptrdiff_t>(nv), b);
        }
    }
}

// Turns planes over [a, a + 360] into planes over [0, 360]. A plane at 0 is interpolated where the file has none;
// it becomes a new column at the end of candela.
std::vector<Plane> start_at_zero(const std::vector<Plane>& planes, std::vector<float>& candela, std::size_t nv) {
    const double cut = 360.0 * std::ceil(planes.front().deg / 360.0);
    std::vector<Plane> result;
    std::size_t first = 0;
    while (planes[first].deg < cut - kMinStepDeg) ++first;
    std::size_t cut_column = planes[first].column;
    if (planes[first].deg > cut + kMinStepDeg) {
        const Plane low = planes[first - 1];
        const Plane high = planes[first];
        const double fraction = (cut - low.deg) / (high.deg - low.deg);
        cut_column = candela.size() / nv;
        for (std::size_t v = 0; v < nv; ++v) {
            const double value =
                std::lerp(double{candela[low.column * nv + v]}, double{candela[high.column * nv + v]}, fraction);
            candela.push_back(static_cast<float>(value));
        }
    } else {
        ++first;
    }
    result.push_back({0.0, cut_column});
    for (std::size_t i = first; i + 1 < planes.size(); ++i) result.push_back({planes[i].deg - cut, planes[i].column});
    // The last plane of the list is the first one again, one turn on.
    for (const Plane& plane : planes) {
        if (plane.deg >= cut - kMinStepDeg) break;
        result.push_back({plane.deg - cut + 360.0, plane.column});
    }
    result.push_back({360.0, cut == planes.front().deg ? planes.back().column : cut_column});
    return result;
}

std::vector<Plane> close_circle(const FileGrid& grid, Symmetry& symmetry, bool& irregular, Report& report) {
    std::vector<Plane> planes;
    for (std::size_t i = 0; i < grid.h_deg.size(); ++i) planes.push_back({grid.h_deg[i], i});
    const double span = grid.h_deg.back() - grid.h_deg.front();
    const bool at_axis = multiple_of_90(grid.h_deg.front());
    const double first = at_axis ? 90.0 * std::round(grid.h_deg.front() / 90.0) : grid.h_deg.front();
    const std::size_t where = grid.h_offset;
    if (planes.size() == 1) {
        symmetry = Symmetry::axial;
        if (first != 0.0) {
            report.warn("single_plane_not_zero", where, "the only plane is not at 0; it is taken for all planes");
        }
        return {{0.0, 0}, {360.0, 0}};
    }
    if (same_angle(span, 90.0) && at_axis) {
        symmetry = Symmetry::quadrant;
        irregular = first != 0.0;
        snap_ends(planes, first, first + 90.0);
        mirror_about_last(planes);
        mirror_about_last(planes);
    } else if (same_angle(span, 180.0) && at_axis) {
        const bool about_0 = std::remainder(first, 180.0) == 0.0;
        symmetry = about_0 ? Symmetry::bilateral_0_180 : Symmetry::bilateral_90_270;
        irregular = first != 0.0 && first != 90.0;
        snap_ends(planes, first, first + 180.0);
        mirror_about_last(planes);
    } else if (same_angle(span, 360.0)) {
        irregular = first != 0.0;
        snap_ends(planes, first, first + 360.0);
    } else {
        const double gap = first + 360.0 - planes.back().deg;
        const double step = planes.back().deg - planes[planes.size() - 2].deg;
        // One step short of the full turn is the common omission; anything else has no defined symmetry.
        irregular = std::abs(gap - step) > 0.01 * step;
        if (!irregular)
            report.warn("missing_360", where, "the plane at 360 is missing; the one at 0 closes the circle");
        planes.push_back({first + 360.0, 0});
        snap_ends(planes, first, first + 360.0);
    }
    if (irregular) {
        report.warn("irregular_h_range", where,
                    "the horizontal angles span none of 0, 0-90, 0-180, 90-270 and 0-360; the gap was interpolated");
    }
    return planes;
}

void report_mismatches(const PhotometricWeb& web, const FileGrid& grid, Report& report) {
    const std::size_t nv = web.v_rad.size();
    const std::size_t last = web.h_rad.size() - 1;
    const float tolerance = kMismatchRatio * *std::max_element(web.candela.begin(), web.candela.end());
    for (std::size_t v = 0; v < nv; ++v) {
        if (std::abs(web.at(0, v) - web.at(last, v)) > tolerance) {
            report.warn("wrap_mismatch", grid.candela_offset, "the planes at 0 and 360 differ; both are kept as given");
            break;
        }
    }
    for (const std::size_t v : {std::size_t{0}, nv - 1}) {
        if (std::sin(web.v_rad[v]) > 1e-6) continue;
        for (std::size_t h = 1; h <= last; ++h) {
            if (std::abs(web.at(h, v) - web.at(0, v)) > tolerance) {
                report.warn("pole_mismatch", grid.candela_offset, "the planes disagree on the value at the pole");
                break;
            }
        }
    }
}

// A single vertical angle has no extent: the web is a sliver around it, dark elsewhere.
void widen_single_v(FileGrid& grid, Report& report) {
    if (grid.v_deg.size() != 1) return;
    constexpr double kSliverDeg = 1e-4;
    report.warn("single_v", grid.v_offset, "one vertical angle only: the luminaire emits nowhere else");
    const double v = grid.v_deg[0];
    const bool at_end = v + kSliverDeg > 180.0 || (grid.goniometer == Goniometer::type_a && v + kSliverDeg > 90.0);
    grid.v_deg = at_end ? std::vector{v - kSliverDeg, v} : std::vector{v, v + kSliverDeg};
    std::vector<float> doubled;
    doubled.reserve(2 * grid.candela.size());
    for (const float value : grid.candela) doubled.insert(doubled.end(), 2, value);
    grid.candela = std::move(doubled);
}

Unfolded unfold_type_c(FileGrid& grid, Report& report) {
    Unfolded result;
    const std::size_t nv = grid.v_deg.size();
    std::vector<Plane> planes = std::move(grid.planes);
    result.symmetry = grid.symmetry;
    if (planes.empty()) planes = close_circle(grid, result.symmetry, result.irregular_h, report);
    if (result.symmetry != Symmetry::axial)
        for (Plane& plane : planes) plane.deg += grid.zero_plane_deg;
    if (!(planes.front().deg == 0.0 && planes.back().deg == 360.0)) planes = start_at_zero(planes, grid.candela, nv);
    const double v_first = grid.v_deg.front();
    const double v_last = grid.v_deg.back();
    const bool known_v = (same_angle(v_first, 0.0) && (same_angle(v_last, 90.0) || same_angle(v_last, 180.0))) ||
                         (same_angle(v_first, 90.0) && same_angle(v_last, 180.0));
    if (!known_v) {
        report.warn("v_range", grid.v_offset, "the vertical angles do not span 0-90, 0-180 or 90-180; dark outside");
    }
    PhotometricWeb& web = result.web;
    web.candela.reserve(planes.size() * nv);
    for (const Plane& plane : planes) {
        web.h_rad.push_back(radians(plane.deg));
        const auto column = grid.candela.begin() + static_cast<std::ptrdiff_t>(plane.column * nv);
        web.candela.insert(web.candela.end(), column, column + static_cast<std::ptrdiff_t>(nv));
    }
    web.h_rad.back() = 2.0 * std::numbers::pi;
    for (const double v : grid.v_deg) web.v_rad.push_back(radians(v));
    report_mismatches(web, grid, report);
    return result;
}

// The columns of an A or B grid along one axis, mirrored about 0 where only one side is given.
std::vector<Plane> mirror_half(const std::vector<double>& angles) {
    std::vector<Plane> planes;
    for (std::size_t i = 0; i < angles.size(); ++i) planes.push_back({angles[i], i});
    if (planes.size() < 2) return planes;
    if (same_angle(angles.back(), 0.0)) {
        mirror_about_last(planes);
    } else if (same_angle(angles.front(), 0.0)) {
        std::reverse(planes.begin(), planes.end());
        for (Plane& plane : planes) plane.deg = -plane.deg;
        mirror_about_last(planes);
    }
    return planes;
}

Unfolded unfold_type_ab(FileGrid& grid, Report& report) {
    Unfolded result;
    const std::size_t nv = grid.v_deg.size();
    std::vector<Plane> rows = mirror_half(grid.v_deg);
    std::vector<Plane> planes = mirror_half(grid.h_deg);
    if (rows.size() != nv) {
        report.warn("v_mirrored", grid.v_offset, "only one half of the vertical angles is given; it was mirrored");
    }
    if (planes.size() != grid.h_deg.size()) result.symmetry = Symmetry::lateral;
    if (planes.size() == 1) {
        report.warn("single_plane", grid.h_offset, "one plane only: it is taken for all horizontal angles, -90 to 90");
        planes = {{-90.0, 0}, {90.0, 0}};
        result.symmetry = Symmetry::axial;
    }
    PhotometricWeb& web = result.web;
    web.goniometer = grid.goniometer;
    for (const Plane& row : rows) web.v_rad.push_back(radians(row.deg));
    web.candela.reserve(planes.size() * rows.size());
    for (const Plane& plane : planes) {
        web.h_rad.push_back(radians(plane.deg));
        for (const Plane& row : rows) web.candela.push_back(grid.candela[plane.column * nv + row.column]);
    }
    return result;
}

}  // namespace

void snap_ends(std::vector<Plane>& planes, double first_deg, double last_deg) {
    planes.front().deg = first_deg;
    planes.back().deg = last_deg;
    const auto inner_begin = planes.begin() + 1;
    const auto inner_end = std::remove_if(inner_begin, planes.end() - 1, [&](const Plane& plane) {
        return plane.deg < first_deg + kMinStepDeg || plane.deg > last_deg - kMinStepDeg;
    });
    planes.erase(inner_end, planes.end() - 1);
}

void mirror_about_last(std::vector<Plane>& planes) {
    const double axis = planes.back().deg;
    for (std::size_t i = planes.size() - 1; i-- > 0;) planes.push_back({2.0 * axis - planes[i].deg, planes[i].column});
}

Unfolded unfold(FileGrid grid, Report& report) {
    const auto tidy = [](double& deg) { deg = std::round(deg * 1e9) / 1e9 + 0.0; };
    for (double& deg : grid.v_deg) tidy(deg);
    for (double& deg : grid.h_deg) tidy(deg);
    if (auto fault = find_fault(grid)) {
        Unfolded refused;
        refused.fault = std::move(fault);
        return refused;
    }
    make_ascending(grid, report);
    widen_single_v(grid, report);
    return grid.goniometer == Goniometer::type_c ? unfold_type_c(grid, report) : unfold_type_ab(grid, report);
}

void turn_about_vertical(PhotometricWeb& web, Angle turn, Report& report) {
    FileGrid grid;
    grid.candela = web.candela;
    for (const double v : web.v_rad) grid.v_deg.push_back(Angle::radians(v).degrees());
    for (std::size_t h = 0; h < web.h_rad.size(); ++h)
        grid.planes.push_back({Angle::radians(web.h_rad[h]).degrees() + turn.degrees(), h});
    Unfolded turned = unfold(std::move(grid), report);
    if (!turned.fault) web = std::move(turned.web);
}

}  // namespace gonio::ies::detail
