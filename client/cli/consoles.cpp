#include "client/cli/output.h"
#include "protocol/schema/console.pb.h"

#include <algorithm>
#include <cstdio>

namespace gonio {
namespace {

constexpr int kShownLevels = 12;  // the first slots; --json has all

std::string universes_text(const google::protobuf::RepeatedField<std::uint32_t>& universes) {
    std::string text;
    for (int i = 0; i < universes.size();) {  // 1-4,7
        int end = i;
        while (end + 1 < universes.size() && universes[end + 1] == universes[end] + 1) ++end;
        text += (text.empty() ? "" : ",") + std::to_string(universes[i]);
        if (end > i) text += "-" + std::to_string(universes[end]);
        i = end + 1;
    }
    return text.empty() ? "none" : text;
}

std::string levels_text(const v1::SourceRow& row) {
    std::string text;
    for (int i = 0; i < row.levels_size() && i < kShownLevels; ++i)
        text += (i > 0 ? " " : "") + std::to_string(row.levels(i));
    if (row.levels_size() > kShownLevels) text += " …";
    return text;
}

}  // namespace

std::string sources_table(const v1::Sources& sources) {
    std::string text;
    const auto is_console = [](const v1::InputEndpoint& one) { return one.protocol() != "box"; };
    if (std::ranges::none_of(sources.endpoints(), is_console))
        text += "goniod listens to no console: start it with --sacn, --artnet or --osc\n";
    char line[1024];
    for (const v1::InputEndpoint& one : sources.endpoints()) {
        if (!is_console(one)) {
            text +=
                "box " + one.address() + ": " + std::to_string(one.packets()) + " messages, " + one.last_error() + "\n";
            continue;
        }
        std::snprintf(line, sizeof line, "%s on %s: %u packets, %u bad, %u dropped by the kernel, %u refused",
                      one.protocol().c_str(), one.address().c_str(), one.packets(), one.bad_packets(),
                      one.kernel_drops(), one.refused_sources());
        text += line;
        if (one.protocol() != "osc") text += "; patched universes " + universes_text(one.universes());
        if (!one.last_error().empty()) text += "; last error: " + one.last_error();
        text += "\n";
    }
    if (std::ranges::none_of(sources.endpoints(), is_console)) return text;
    std::snprintf(line, sizeof line, "%-7s %5s %-24s %-22s %4s %7s %6s %6s %-10s %5s %6s  %s\n", "from", "univ", "name",
                  "address", "prio", "rate/s", "lost", "order", "state", "wins", "age s", "levels");
    text += line;
    for (const v1::SourceRow& row : sources.sources()) {
        const std::string priority = row.slot_priorities()      ? "slot"
                                     : row.protocol() == "sacn" ? std::to_string(row.priority())
                                                                : "-";
        std::snprintf(line, sizeof line, "%-7s %5u %-24.63s %-22s %4s %7.1f %6u %6u %-10s %5u %6.1f  ",
                      row.protocol().c_str(), row.universe(), row.name().c_str(), row.address().c_str(),
                      priority.c_str(), row.rate_hz(), row.lost(), row.out_of_order(), row.state().c_str(),
                      row.winning_slots(), row.age_s());
        text += line + levels_text(row) + "\n";
    }
    for (const v1::DiscoveredSource& row : sources.discovered())
        text += "sacn    " + row.name() + " at " + row.address() + " says it sends universes " +
                universes_text(row.universes()) + "\n";
    return text;
}

}  // namespace gonio
