// What a stress run measures: one finding per bound, with the worst figure and where it was met.
#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <iosfwd>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace gonio::stress {

struct Finding {
    std::string group;   // the case: "contact", "scale", ...
    std::string figure;  // what is measured, with its unit
    double bound = 0.0;
    bool gated = true;  // a figure above the bound is a failure; else it is only reported
    std::uint64_t checks = 0;
    double worst = 0.0;
    std::string where;                                    // of the worst
    std::vector<std::pair<std::string, double>> profile;  // the figure along a sweep, where that is the point

    // A value that is not finite counts as infinitely bad. where(): how to find it again, called only for a new worst.
    template <typename Where>
    void note(double value, Where where_of) {
        ++checks;
        if (!std::isfinite(value)) value = std::numeric_limits<double>::infinity();
        if (value <= worst) return;
        worst = value;
        where = where_of();
    }
    bool passed() const { return checks > 0 && worst <= bound; }
};

class Findings {
public:
    // Result: the finding of this name, made on first use. References stay valid.
    Finding& of(const std::string& group, const std::string& figure, double bound, bool gated = true);
    const std::deque<Finding>& all() const { return findings_; }
    bool passed() const;  // every gated finding
    void took(const std::string& group, double seconds) { seconds_.emplace_back(group, seconds); }
    const std::vector<std::pair<std::string, double>>& seconds() const { return seconds_; }

private:
    std::deque<Finding> findings_;
    std::vector<std::pair<std::string, double>> seconds_;  // by case
};

void print_table(const Findings& findings, std::ostream& out);
void print_json(const Findings& findings, const std::string& renderer, std::uint64_t seed, std::ostream& out);

}  // namespace gonio::stress
