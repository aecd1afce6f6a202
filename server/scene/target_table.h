// What interior lighting is held against: rows of a standard, as data. Pure.
#pragma once

#include <span>
#include <string_view>

#include "protocol/schema/messages.h"

namespace gonio {

// 0 where the source of the row does not tell the value.
struct TargetRow {
    std::string_view name;     // that a grid's or observer's target has
    std::string_view task;     // area, task or activity
    double em_lx;              // maintained mean illuminance, required
    double em_modified_lx;     // where the modifiers of context apply
    double u0_ratio;           // uniformity
    double ugr;                // upper limit
    double ez_lx;              // maintained mean cylindrical illuminance
    double ra;                 // colour rendering index
    std::string_view edition;  // of the standard
};

// Result: all rows.
std::span<const TargetRow> target_table();
// Result: the row of this name, or nullptr.
const TargetRow* find_target(std::string_view name);
void put_target(const TargetRow& row, v1::Target& target);

}  // namespace gonio
