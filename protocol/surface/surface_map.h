// What the controls of control surfaces drive: checks and arithmetic on the rows of surface.proto. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

inline constexpr std::size_t kMaxSurfaceRows = 4096;  // one more is refused: "too_large"
inline constexpr std::uint32_t kMaxSurfacePages = 64;
inline constexpr std::string_view kPageProperty = "page";  // the one property that is the surface's own

// Result: true. That the targets exist is not asked. Errors: "invalid_argument" with the field as place
// ("set_surfaces.rows[3].curve"), "too_large".
Result<bool> check_surfaces(const v1::SetSurfaces& set);
// Result: true. `place` is the row's ("map_control.row."). Errors: "invalid_argument".
Result<bool> check_surface_row(const v1::SurfaceRow& row, const std::string& place);

// Result: the rows after one was added or removed. Errors: of check_surface_row; "too_large"; "not_found" where there
// is nothing to remove.
Result<v1::SetSurfaces> mapped(const v1::SetSurfaces& rows, const v1::MapControl& change);

// Result: n of "#n" (1..4096), else nothing.
std::optional<std::uint32_t> light_number(std::string_view target);
// Result: whether a row for `device` means the surface: "*", its "vvvv:pppp", or all of its identity.
bool means_box(std::string_view device, std::string_view identity);
// Result: whether both rows are for one control on one page.
bool same_control(const v1::SurfaceRow& a, const v1::SurfaceRow& b);
// Result: the index of the light that the row's "#n" means on a page (from 1), from 0.
std::uint32_t light_index(const v1::SurfaceRow& row, std::uint32_t number, std::uint32_t page);

// How a position becomes a share of the range; v and the result are 0..1. Names are those of SurfaceRow.curve.
double curve_of(std::string_view name, double v);
// The inverse: the position that stands for a share.
double position_of(std::string_view name, double share);

}  // namespace gonio
