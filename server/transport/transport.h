// A scene's transport as far as it is made, and the thread that makes it.
#pragma once

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "server/base/shared.h"
#include "server/trace/sources.h"
#include "server/transport/solve.h"

namespace gonio::transport {

// What stands still while lights and cameras move. Immutable; any thread.
struct Transport {
    struct Surface {               // shared by all generations
        std::uint64_t number = 0;  // never used twice
        std::shared_ptr<const trace::Geometry> geometry;
        Surfels surfels;
        std::unique_ptr<const CellMap> cells;
        trace::World emitters;  // emissive surfaces alone
    };
    std::shared_ptr<const Surface> surface;
    Links links;
    std::vector<float> met_m2;                    // area of each surfel as the links meet it
    Irradiance emitted;                           // light of emissive surfaces, lux; empty: there are none
    double seconds = 0.0;                         // that making it took
    std::shared_ptr<const CellMap::Table> cells;  // of the surface's, as far as it is filled; null: not asked for
    std::size_t bytes() const;
};

// Result: the same in air that absorbs: less arrives along links. Of what emissive surfaces send straight to a surfel,
// as much is lost as along its own links. absorption: local coordinates.
Transport in_air(const Transport& transport, const Haze& absorption, Pool& pool);

// Makes the generations of a scene's transport one after the other, on threads of its own. Made, asked and destroyed on
// the render thread.
class Builder {
public:
    // The seeds are local positions of luminaires and eyes. Each surfel has so many links, or those of the next
    // generation that is published, and none beyond until more are wanted. With beside, it runs at a quarter of the
    // weight of what else is busy (frames), after the first links at a tenth. With cells, Transport::cells is asked
    // for.
    Builder(std::shared_ptr<const trace::Geometry> geometry, std::vector<glm::vec3> seeds,
            const SurfelSettings& settings, unsigned links, bool beside, bool cells);
    ~Builder();
    Builder(const Builder&) = delete;
    Builder& operator=(const Builder&) = delete;

    // Result: the newest generation; null: none yet.
    std::shared_ptr<const Transport> newest() const { return newest_.load(); }
    // Whether all links that are wanted are there.
    bool done() const { return made_ >= wanted_; }
    // Goes on to so many links of each surfel.
    void want(unsigned links);
    // Returns when they are there.
    void wait();
    // Stops working, within some milliseconds, until told to go on.
    void hold(bool held);

private:
    void make(std::shared_ptr<const trace::Geometry> geometry, std::vector<glm::vec3> seeds,
              const SurfelSettings& settings, bool beside, bool cells);
    bool wanted(unsigned links);  // its thread: waits until that is known
    bool stopped() const;         // its threads: waits while it is held

    Shared<const Transport> newest_;
    std::atomic<unsigned> wanted_, made_ = 0;
    std::atomic<bool> stopped_ = false, held_ = false;
    std::jthread thread_;
};

// Whether what a luminaire or an eye at this point sees has surfels: else walks from it have to find them.
bool reaches(const Transport& transport, const glm::vec3& point);

}  // namespace gonio::transport
