#include "server/scene/target_table.h"

#include <algorithm>

#include "protocol/schema/grid.pb.h"

namespace gonio {
namespace {

constexpr std::string_view k2021 = "EN 12464-1:2021", k2011 = "EN 12464-1:2011";

// Only what could be read of the editions or of pages that quote them. A value that is missing here is not checked.
constexpr TargetRow kTargets[] = {
    {"office-writing", "writing, typing, reading, data processing", 500, 1000, 0.60, 19, 150, 80, k2021},
    {"office-writing-wall", "walls of a room for writing and reading", 150, 0, 0, 0, 0, 0, k2021},
    {"office-writing-ceiling", "ceiling of a room for writing and reading", 100, 0, 0, 0, 0, 0, k2021},
    {"office-filing", "filing, copying", 300, 500, 0.40, 0, 0, 80, k2021},
    {"technical-drawing", "technical drawing", 0, 0, 0, 16, 0, 0, k2021},
    {"workshop", "workshop", 0, 0, 0, 22, 0, 0, k2021},
    {"reception", "reception desk", 0, 0, 0, 22, 0, 0, k2021},
    {"surround", "immediate surround of a task area", 0, 0, 0.40, 0, 0, 0, k2021},
    {"background", "background area", 0, 0, 0.10, 0, 0, 0, k2021},
    {"communication", "faces where people talk to each other", 0, 0, 0.10, 0, 150, 0, k2021},
    {"occupied", "rooms and places of activity in general", 0, 0, 0.10, 0, 50, 0, k2021},
    {"wall-2011", "walls", 50, 0, 0.10, 0, 0, 0, k2011},
    {"ceiling-2011", "ceiling", 30, 0, 0.10, 0, 0, 0, k2011},
    {"office-wall-2011", "walls of offices, schools and hospitals", 75, 0, 0.10, 0, 0, 0, k2011},
    {"office-ceiling-2011", "ceilings of offices, schools and hospitals", 50, 0, 0.10, 0, 0, 0, k2011},
};

}  // namespace

std::span<const TargetRow> target_table() {
    return kTargets;
}

const TargetRow* find_target(std::string_view name) {
    const auto* const at = std::ranges::find(kTargets, name, &TargetRow::name);
    return at == std::end(kTargets) ? nullptr : at;
}

void put_target(const TargetRow& row, v1::Target& target) {
    target.Clear();
    target.set_name(std::string(row.name));
    if (row.em_lx > 0) target.set_em_lx(row.em_lx);
    if (row.em_modified_lx > 0) target.set_em_modified_lx(row.em_modified_lx);
    if (row.u0_ratio > 0) target.set_u0_ratio(row.u0_ratio);
    if (row.ugr > 0) target.set_ugr(row.ugr);
    if (row.ez_lx > 0) target.set_ez_lx(row.ez_lx);
    if (row.ra > 0) target.set_ra(row.ra);
    target.set_task(std::string(row.task));
    target.set_edition(std::string(row.edition));
}

}  // namespace gonio
