// Everything that a client can ask of a server, as a table of operations whose values are drawn at random from a seed:
// what the mixed soak does, and does again.
#pragma once

#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/schema/gonio.pb.h"

namespace gonio::soak {

class Draw {
public:
    explicit Draw(unsigned seed) : random_(seed) {}
    double number(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
    int whole(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }
    bool coin() { return whole(0, 1) == 1; }
    // Result: "PREFIX 0" to "PREFIX COUNT-1": few names, so that clients meet at them.
    std::string name(const std::string& prefix, int count) {
        return prefix + " " + std::to_string(whole(0, count - 1));
    }
    template <typename Value>
    Value any(std::initializer_list<Value> of) {
        return *(of.begin() + whole(0, static_cast<int>(of.size()) - 1));
    }
    // Result: one of the lights that were there when somebody last looked; a name that no light has where none were.
    std::string light();
    std::vector<std::string> lights;

private:
    std::mt19937 random_;
};

struct Operation {
    std::string_view name;
    int weight = 1;     // how often, beside the others
    bool slow = false;  // the loader, a capture or a measurement answers, not the next frame alone
    // Codes of refusals that are right where clients work beside each other: a name is gone, nothing is to be undone.
    std::string_view refusals;
    void (*fill)(Draw& draw, v1::ClientMessage& message);
};

std::span<const Operation> operations();
// Result: an index into them, by weight.
int next_operation(Draw& draw);
// Whether an answer with this code is one that the operation may get. Busy servers may always say so.
bool is_expected(const Operation& operation, std::string_view code);

}  // namespace gonio::soak
