// gonio-bench report: docs/performance.md and docs/notebook/performance.md out of saved results and templates, so that
// no figure of them is copied by hand.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace gonio::bench {

struct Report {
    std::map<std::string, std::string> pages;  // by their path below docs: performance.md, notebook/performance.md
    std::string pareto_svg;                    // docs/images/pareto.svg
};
// results: a folder of tests/bench/results. templates: a folder with performance.in.md and notebook.in.md, in which
// {{name}} stands for a table or a figure. Throws std::runtime_error for a name that is not known, a table that no
// template uses, and a file that cannot be read.
Report make_report(const std::filesystem::path& results, const std::filesystem::path& templates);

// Writes all files. Throws std::runtime_error.
void write_report(const Report& report, const std::filesystem::path& docs);

}  // namespace gonio::bench
