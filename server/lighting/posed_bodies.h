// Bodies of luminaires (server/scene/body.h) as the CPU rasterises them: clusters of a scene of their own, of which the
// parts that have moved are placed anew. Render thread.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "server/lighting/clusters.h"
#include "server/scene/body.h"

namespace gonio::lighting {

class PosedBodies {
public:
    // They are nowhere until they are placed.
    explicit PosedBodies(std::shared_ptr<const Bodies> bodies);

    // local_from_home: of part `index`; nothing: it is not there.
    void place(std::size_t index, const std::optional<glm::dmat4>& local_from_home);

    const Clusters& clusters() const { return clusters_; }
    // Its triangles are those of all parts, one after the other.
    const MaterialTable& material_table() const { return table_; }
    // Result: of which part a triangle is.
    std::size_t part_of(std::uint32_t triangle) const;

private:
    struct Range {
        std::size_t first = 0, end = 0;
    };
    std::shared_ptr<const Bodies> bodies_;
    Clusters home_, clusters_;
    std::vector<MaterialTable::Triangle> home_triangles_;
    MaterialTable table_;
    std::vector<Range> clusters_of_;  // by part
};

}  // namespace gonio::lighting
