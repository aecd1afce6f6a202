// Shows and gels as tables.
#include <cstdio>

#include "client/cli/output.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/show.pb.h"

namespace gonio {

std::string shows_table(const v1::Shows& shows) {
    char line[256];
    std::snprintf(line, sizeof line, "%12s %10s  %s\n", "bytes", "age_s", "show");
    std::string text = line;
    for (const v1::ShowEntry& show : shows.shows()) {
        std::snprintf(line, sizeof line, "%12.0f %10.0f  ", show.bytes(), show.age_s());
        text += line + show.name() + "\n";
    }
    if (shows.left_out() > 0) text += "and " + std::to_string(shows.left_out()) + " more\n";
    return text;
}

std::string gels_table(const v1::Gels& gels) {
    char line[256];
    std::snprintf(line, sizeof line, "%-32s %13s %13s %12s\n", "gel", "light x,y", "behind x,y", "transmission");
    std::string text = line;
    for (const v1::Gel& gel : gels.gels()) {
        for (int i = 0; i < gel.measured_size(); ++i) {
            const v1::GelMeasurement& one = gel.measured(i);
            if (one.of_xy_size() != 2 || one.xy_size() != 2) continue;
            std::snprintf(line, sizeof line, "%-32.128s %6.4f,%6.4f %6.4f,%6.4f %12.3f\n",
                          i == 0 ? gel.name().c_str() : "", one.of_xy(0), one.of_xy(1), one.xy(0), one.xy(1),
                          one.transmission_ratio());
            text += line;
        }
    }
    return text;
}

}  // namespace gonio
