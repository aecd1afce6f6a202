// What one scene revision looks like to rays.
#pragma once

#include "server/trace/sources.h"

namespace gonio::trace {

struct World {
    std::shared_ptr<const Geometry> geometry;
    std::vector<Luminaire> luminaires;
    std::vector<double> running;  // running sums of the luminaires' power; luminaires.size() + 1
    Emitters emitters;
};

}  // namespace gonio::trace
