#include "tests/stress/findings.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <ostream>

namespace gonio::stress {
namespace {

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
}

const char* verdict(const Finding& finding) {
    return !finding.gated ? "measured" : finding.passed() ? "pass" : "FAIL";
}

}  // namespace

Finding& Findings::of(const std::string& group, const std::string& figure, double bound, bool gated) {
    for (Finding& finding : findings_) {
        if (finding.group == group && finding.figure == figure) return finding;
    }
    Finding& fresh = findings_.emplace_back();
    fresh.group = group;
    fresh.figure = figure;
    fresh.bound = bound;
    fresh.gated = gated;
    return fresh;
}

bool Findings::passed() const {
    return std::all_of(findings_.begin(), findings_.end(), [](const Finding& f) { return !f.gated || f.passed(); });
}

void print_table(const Findings& findings, std::ostream& out) {
    char line[512];
    std::snprintf(line, sizeof line, "%-12s %-52s %12s %10s %10s  %s\n", "case", "figure", "checks", "worst", "bound",
                  "verdict");
    out << line;
    for (const Finding& f : findings.all()) {
        std::snprintf(line, sizeof line, "%-12s %-52s %12llu %10s %10s  %s\n", f.group.c_str(), f.figure.c_str(),
                      static_cast<unsigned long long>(f.checks), number(f.worst).c_str(), number(f.bound).c_str(),
                      verdict(f));
        out << line;
        if (!f.where.empty()) out << "             worst at " << f.where << "\n";
        if (f.profile.empty()) continue;
        out << "            ";
        for (const auto& [at, value] : f.profile) out << " " << at << ": " << number(value) << ";";
        out << "\n";
    }
    out << "seconds:";
    for (const auto& [group, seconds] : findings.seconds()) out << " " << group << " " << number(seconds) << ";";
    out << "\n";
}

void print_json(const Findings& findings, const std::string& renderer, std::uint64_t seed, std::ostream& out) {
    nlohmann::json json = {{"renderer", renderer}, {"seed", seed}, {"passed", findings.passed()}};
    for (const Finding& f : findings.all()) {
        nlohmann::json row = {{"case", f.group},  {"figure", f.figure},    {"checks", f.checks},
                              {"bound", f.bound}, {"verdict", verdict(f)}, {"where", f.where}};
        // JSON has no infinity: a value that was not finite is null.
        row["worst"] = std::isfinite(f.worst) ? nlohmann::json(f.worst) : nlohmann::json();
        for (const auto& [at, value] : f.profile) row["profile"].push_back({{"at", at}, {"value", value}});
        json["rows"].push_back(std::move(row));
    }
    for (const auto& [group, seconds] : findings.seconds()) json["seconds"][group] = seconds;
    out << json.dump(2) << "\n";
}

}  // namespace gonio::stress
