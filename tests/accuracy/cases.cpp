#include "tests/accuracy/cases.h"

#include <utility>

namespace gonio::accuracy {

const std::vector<Case>& cases() {
    static const std::vector<Case> all = [] {
        std::vector<Case> list = cie171_cases();
        for (auto more : {source_cases, room_cases}) {
            for (Case& c : more()) list.push_back(std::move(c));
        }
        return list;
    }();
    return all;
}

}  // namespace gonio::accuracy
