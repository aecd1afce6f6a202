// The patch: which slots of which universe drive which property. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ies/core/result.h"
#include "protocol/dmx/dmx.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/property.h"

namespace gonio {

inline constexpr std::size_t kMaxPatchRows = 4096;  // one more is refused: "too_large"
inline constexpr int kMaxPatchRanges = 256;         // of a row; likewise: "invalid_argument"

// Result: true. Errors: "invalid_argument" with the field as place ("set_patch.rows[3].address"), "too_large".
// That the targets exist is not asked: a scene may bring them later.
Result<bool> check_patch(const v1::SetPatch& patch);

// Result: the patch of a scene that has none: light n's level, 8 bits, at address n of sACN universe 1 and of Art-Net
// port-address 0. Lights beyond 512 have no slot.
v1::Patch default_patch(std::span<const std::string> lights);

// Result: what of the patch reaches beyond what can be joined (sACN) or told to consoles (Art-Net), a sentence each.
std::vector<std::string> patch_limits(const v1::Patch& patch);

// Result: the universe of a row that was checked.
DmxKey key_of(const v1::PatchRow& row);
// Result: the universes that the rows use, ascending, each once.
std::vector<DmxKey> universes_of(const v1::Patch& patch);

// Reads universes through a patch. It remembers what each row said last. A row speaks when its slots change, so that a
// console that repeats itself does not take back what another hand has set since.
class PatchReader {
public:
    PatchReader() = default;
    PatchReader(PatchReader&&) = default;
    PatchReader& operator=(PatchReader&&) = default;
    explicit PatchReader(const v1::Patch& patch);  // rows must have been checked

    // Result: what the universe, as it is now, changes. All slots of a row come from one sender's one packet. The
    // highest priority of the row's first slot wins. Among equals a level or master takes the highest value (of all its
    // 16 bits), everything else the sender that changed its row last. Rows that no sender controls keep their value. Of
    // rows of several universes for one level or master the highest value counts of those that a sender controls,
    // unless they are merged as "latest". Rows merged as "sum" or "product" for one property are one value, as long as
    // a sender controls one of them; the others count as they were. Of all others the one that changed last counts.
    std::vector<PropertyValue> read(const DmxKey& key, const DmxUniverse& universe);
    void read(const DmxKey& key, const DmxUniverse& universe, std::vector<PropertyValue>& values);  // behind others
    // The rows for the target, or of the property, speak again when their universes are next read. What they said was
    // for a target that was not there, or could not be carried out.
    void forget(std::string_view target);
    void forget(Property property);

private:
    using Raw = std::array<std::uint32_t, 3>;
    struct Candidate {
        const DmxSource* source;
        Raw raw;
    };
    struct Row {
        v1::PatchRow row;
        const PropertyRow* property = nullptr;
        unsigned bytes = 1;        // of a value
        std::optional<Raw> said;   // what the row said last; of a profile its index in the list
        std::uint32_t holder = 0;  // the sender that it listens to
        // Of each sender that has a say, at most kMaxUniverseSources; kept where the one that moved last wins.
        std::vector<std::pair<std::uint32_t, Raw>> last;
        std::size_t joint = SIZE_MAX;    // index into joints_: with others it is one value
        std::optional<double> stands{};  // then: what it says, or said last
        bool controlled = false;         // by a sender
    };
    enum class Merge : std::uint8_t { latest, highest, sum, product };  // PatchRow::merge
    static Merge merge_of(const Row& row);
    struct Joint {
        std::vector<const Row*> rows;  // in rows_, which does not change any more
        Merge merge = Merge::highest;
        std::optional<double> said;  // the value, as it was said last
        bool read = false;           // a row of it has been, just now
    };
    void unsay(Row& row);
    static void say_joint(Joint& joint, std::vector<PropertyValue>& values);
    static std::optional<double> value_of(const Row& row, std::uint32_t raw);
    std::optional<Raw> decide(Row& row, const DmxUniverse& universe);
    const Candidate* moved_last(Row& row) const;
    std::map<DmxKey, std::vector<Row>> rows_;
    std::vector<Joint> joints_;          // by target, property and merge
    std::vector<Candidate> candidates_;  // of the row being read
};

}  // namespace gonio
