// gonio-bench report: docs/performance.md out of saved results and a template, so that no figure of it is copied by
// hand.
#pragma once

#include <filesystem>
#include <string>

namespace gonio::bench {

struct Report {
    std::string markdown;    // docs/performance.md
    std::string pareto_svg;  // docs/images/pareto.svg
};
// results: a folder of tests/bench/results. In the template {{name}} stands for a table or a figure; throws
// std::runtime_error for a name that is not known, a table that is not used, and a file that cannot be read.
Report make_report(const std::filesystem::path& results, const std::filesystem::path& page_template);

// Writes both files. Throws std::runtime_error.
void write_report(const Report& report, const std::filesystem::path& docs);

}  // namespace gonio::bench
