#include "tests/soak/footprint.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace gonio::soak {

static double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

Footprint footprint(pid_t pid, double minute) {
    const std::string process = "/proc/" + std::to_string(pid);
    Footprint result;
    result.minute = minute;
    std::ifstream status(process + "/status");
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with("VmRSS:")) result.resident_mib = std::atof(line.c_str() + 6) / 1024;
        if (line.starts_with("RssAnon:")) result.anonymous_mib = std::atof(line.c_str() + 8) / 1024;
    }
    const std::filesystem::directory_iterator open(process + "/fd");
    result.descriptors = static_cast<std::size_t>(std::distance(begin(open), end(open)));
    return result;
}

Growth growth_of(const std::vector<Footprint>& samples, const Span& early, const Span& late) {
    std::vector<double> first, last;
    for (const Footprint& sample : samples) {
        if (sample.minute >= early.from && sample.minute <= early.to) first.push_back(sample.resident_mib);
        if (sample.minute >= late.from && sample.minute <= late.to) last.push_back(sample.resident_mib);
    }
    if (first.empty() || last.empty()) return {};
    return {median(first), median(last)};
}

}  // namespace gonio::soak
