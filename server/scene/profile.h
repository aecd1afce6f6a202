// A profile: the photometry that lights share, and the pictures of its gobos. Immutable.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ies/lm63.h"

namespace gonio {

struct LightTables;

// The tables of a profile, made when they are first asked for (light_tables.h). A copy of the profile makes its own.
struct LightTablesOnce {
    mutable std::mutex mutex;
    mutable std::shared_ptr<const LightTables> made;
    LightTablesOnce() = default;
    LightTablesOnce(const LightTablesOnce&) {}
    LightTablesOnce& operator=(const LightTablesOnce&) = delete;
    bool operator==(const LightTablesOnce&) const { return true; }
};

struct PackedGobo;

// A slot of a luminaire's wheel: how much of the light a picture in the gate lets through.
struct Gobo {
    std::string name;
    int size_px = 0;                             // of each side; 0: it has no picture and is open
    std::vector<std::uint16_t> transmission{};   // rows from the top, 65535: all passes; ask transmission_of()
    std::shared_ptr<const PackedGobo> packed{};  // packed_gobo.h; null: the transmission is as it stands
    bool operator==(const Gobo&) const = default;
};
using Gobos = std::vector<Gobo>;

// A profile as lights share it.
struct Profile {
    std::string name;
    std::string product;  // maker and luminaire, as lists show it; empty: the file tells neither (ies/product.h)
    ies::Photometry photometry;
    double peak_cd = 0.0;                // of the web
    double flux_lm = 0.0;                // its integral
    bool uploaded = false;               // by a client
    std::shared_ptr<const Gobos> gobos;  // of its wheel; null: it has none
    LightTablesOnce tables;
    double open_width_rad = 0.0;  // of half the peak without the picture that is in the web; 0: there is none in it
    bool operator==(const Profile&) const = default;
};

}  // namespace gonio
