// What the passes of the default technique have to do at the least, counted: operations by kernel, bytes, rays; and how
// long that takes at the rates that `gonio-bench machine` measures.
#pragma once

#include <map>
#include <string>

#include "tests/bench/report_parts.h"

namespace gonio::bench {

inline constexpr double kFlopsPerEvaluation = 37.0;  // of a VPL at a point

// Both for cornell and for atrium, 800 × 800.
std::string operations_table(const Json& scaling);
std::string limits_table(const Json& scaling, const Json& machine);
// Single figures that the text has of it, by name.
std::map<std::string, std::string> limit_figures(const Json& scaling, const Json& machine);

}  // namespace gonio::bench
