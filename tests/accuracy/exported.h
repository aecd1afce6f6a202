// A room that Blender's own exporter wrote, with what Blender's Cycles measures in it, against the reference and the
// meters and pictures of the interactive quality. tests/e2e/blender/room_scene.py makes both.
#pragma once

#include <string>
#include <vector>

#include "server/gl/context.h"

namespace gonio::accuracy {

inline constexpr double kExportTolerance = 0.03;   // of Cycles' figure, in each channel
inline constexpr double kExportClosedForm = 0.01;  // of the closed form
inline constexpr double kExportBounce = 0.10;      // where links stand for one bounce: of a channel, at a point
inline constexpr double kExportPenumbra = 0.02;    // where the sun's disc is 0.53° here and 0.526° in Blender
inline constexpr double kExportDark_lx = 0.01;     // where no light comes to

// Points of one kind. Differences are the largest over points and channels, relative to the truth; of dark points they
// are lux.
struct ExportRow {
    std::string group, quantity;  // "sun, through the glass"; "direct_lx", "disc_lx", "bounce_lx", "direct_nit"
    int points = 0;
    bool dark = false, has_closed_form = false, has_interactive = false;
    double brightest = 0.0;                       // lux or cd/m², as Cycles has it
    double cycles = 0.0;                          // the reference against Cycles
    double closed_form = 0.0, interactive = 0.0;  // the reference, the interactive quality against it
    bool good() const;
};

// Reads DIRECTORY/room.glb and expected.json. Needs EGL. Throws std::exception where a file is missing or has not
// what it should, or where lights or camera are not those that were exported.
std::vector<ExportRow> compare_export(const gl::Context& context, const std::string& directory);

std::string export_markdown(const std::vector<ExportRow>& rows);

}  // namespace gonio::accuracy
