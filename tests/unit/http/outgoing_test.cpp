#include "server/http/outgoing.h"

#include <gtest/gtest.h>

namespace gonio {
namespace {

using Kind = Outgoing::Kind;
using Pushed = OutgoingQueue::Pushed;

std::shared_ptr<const std::string> bytes_of(std::size_t count) {
    return std::make_shared<const std::string>(count, 'x');
}

class OutgoingQueueTest : public testing::Test {
protected:
    Kind next() {
        const Kind kind = queue.begin_write().kind;
        queue.end_write();
        return kind;
    }
    HttpLimits limits{.queued_messages = 3, .queued_bytes = 100};
    OutgoingQueue queue{limits};
};

TEST_F(OutgoingQueueTest, MergesChangesAtTheBoundOfMessages) {
    for (const std::uint32_t rev : {1u, 2u})
        EXPECT_EQ(queue.push(bytes_of(1), Kind::state_changed, rev), Pushed::queued);
    EXPECT_EQ(queue.push(bytes_of(1), Kind::reply, 0), Pushed::queued);
    EXPECT_EQ(queue.push(bytes_of(1), Kind::state_changed, 3), Pushed::merged);
    EXPECT_EQ(next(), Kind::reply);
    EXPECT_EQ(next(), Kind::whole_state);
    EXPECT_TRUE(queue.empty());
}

TEST_F(OutgoingQueueTest, MergesChangesAtTheBoundOfBytes) {
    EXPECT_EQ(queue.push(bytes_of(90), Kind::state_changed, 1), Pushed::queued);
    queue.begin_write();
    EXPECT_EQ(queue.waiting_bytes(), 90u) << "what is being written counts";
    EXPECT_EQ(queue.push(bytes_of(20), Kind::state_changed, 2), Pushed::merged);
    EXPECT_EQ(queue.push(bytes_of(200), Kind::reply, 0), Pushed::queued) << "answers are bounded by their number";
    queue.end_write();
    EXPECT_EQ(next(), Kind::whole_state);
    EXPECT_EQ(next(), Kind::reply);
}

TEST_F(OutgoingQueueTest, AnswersThatPileUpAreTooMany) {
    for (int i = 0; i < 3; ++i) EXPECT_EQ(queue.push(bytes_of(1), Kind::reply, 0), Pushed::queued);
    EXPECT_EQ(queue.push(bytes_of(1), Kind::reply, 0), Pushed::too_slow);
}

TEST_F(OutgoingQueueTest, DropsChangesThatAWholeStateContains) {
    for (const std::uint32_t rev : {4u, 5u, 6u}) queue.push(bytes_of(1), Kind::state_changed, rev);
    queue.drop_changes_until(5);
    EXPECT_EQ(queue.begin_write().scene_rev, 6u);
    EXPECT_TRUE(queue.empty());
}

}  // namespace
}  // namespace gonio
