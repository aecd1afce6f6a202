#include "tests/soak/metrics_text.h"

#include <cstdlib>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace gonio::soak {

std::string metrics_fault(const std::string& text) {
    static const std::regex kHelp(R"(# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) [^\\]+)"),
        kType(R"(# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge|histogram))"),
        kSample(R"(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{[a-zA-Z_]\w*="[^"\\]*"(,[a-zA-Z_]\w*="[^"\\]*")*\})? ([^ ]+))"),
        kValue(R"([+-]?(Inf|[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?)|NaN)"), kPart("(.*)_(bucket|sum|count)");
    if (text.empty() || text.back() != '\n') return "the text does not end with a line";
    std::set<std::string> helped, samples;
    std::map<std::string, std::string> types;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        std::smatch found;
        if (std::regex_match(line, found, kHelp)) {
            if (!helped.insert(found[1]).second) return line + ": HELP twice";
        } else if (std::regex_match(line, found, kType)) {
            if (!types.emplace(found[1], found[2]).second) return line + ": TYPE twice";
        } else if (std::regex_match(line, found, kSample)) {
            std::smatch part;
            std::string family = found[1];
            if (!types.contains(family) && std::regex_match(family, part, kPart)) {
                family = part[1];
                if (types[family] != "histogram") return line + ": of no histogram";
            }
            if (!types.contains(family) || !helped.contains(family)) return line + ": no HELP and TYPE before it";
            if (!std::regex_match(found[4].str(), kValue)) return line + ": no number";
            if (!samples.insert(found[1].str() + found[2].str()).second) return line + ": twice";
        } else {
            return line + ": neither a comment nor a sample";
        }
    }
    return samples.empty() ? "there is no sample" : "";
}

double metric_value(const std::string& text, std::string_view name) {
    const std::size_t at = ("\n" + text).find("\n" + std::string(name) + " ");
    return at == std::string::npos ? -1 : std::atof(text.c_str() + at + name.size() + 1);
}

}  // namespace gonio::soak
