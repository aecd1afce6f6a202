// Who may change what, and who holds the camera.
#include "server/session/roles.h"
#include "protocol/schema/session.pb.h"
#include "tests/unit/second.h"

#include <gtest/gtest.h>

namespace gonio {
namespace {

class RolesTest : public testing::Test {
protected:
    void SetUp() override {
        identify(1, "ann");
        identify(2, "bob");
        identify(3, "eve", "viewer");
    }
    void identify(std::uint32_t session, const std::string& name, const std::string& role = "") {
        v1::Identify identify;
        identify.set_client(name);
        identify.set_role(role);
        roles.identify(session, identify);
    }
    static std::string code(const std::optional<Error>& error) { return error ? error->code : "ok"; }
    Roles roles;
};

TEST_F(RolesTest, ViewersAndUnknownSessionsChangeNothing) {
    EXPECT_EQ(code(roles.refuses_change(1, "command")), "ok");
    EXPECT_EQ(code(roles.refuses_change(0, "command")), "ok") << "consoles and fader boxes";
    const auto refused = roles.refuses_change(3, "command");
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->code, "permission");
    EXPECT_EQ(refused->where, "command");
    EXPECT_EQ(code(roles.refuses_change(9, "command")), "permission") << "it has not shown itself";
    identify(4, "joe", "controller");
    EXPECT_EQ(code(roles.refuses_change(4, "command")), "ok");
    roles.forget(1);
    EXPECT_EQ(code(roles.refuses_change(1, "command")), "permission");
}

TEST_F(RolesTest, TheLeaseIsExclusiveAndNamesItsHolder) {
    EXPECT_EQ(roles.control().holder(), 0u);
    EXPECT_EQ(code(roles.refuses_camera(2, 0)), "ok") << "nobody holds it";
    ASSERT_EQ(code(roles.acquire(1, false, 0)), "ok");
    EXPECT_EQ(roles.control().holder(), 1u);
    EXPECT_EQ(roles.control().name(), "ann");
    const auto refused = roles.refuses_camera(2, kSecond);
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->code, "held");
    EXPECT_EQ(refused->value, "ann");
    EXPECT_EQ(code(roles.refuses_camera(0, kSecond)), "held") << "consoles and fader boxes too";
    EXPECT_EQ(code(roles.acquire(2, false, kSecond)), "held");
    EXPECT_EQ(code(roles.release(2)), "held");
    EXPECT_EQ(code(roles.acquire(2, true, kSecond)), "ok");
    EXPECT_EQ(roles.control().name(), "bob");
    EXPECT_EQ(code(roles.refuses_camera(1, kSecond)), "held");
    EXPECT_EQ(code(roles.release(2)), "ok");
    EXPECT_EQ(roles.holder(), 0u);
    EXPECT_EQ(code(roles.release(1)), "ok") << "nobody holds it: nothing to release";
}

TEST_F(RolesTest, TheLeaseLastsThirtySecondsFromTheHoldersLastWord) {
    roles.acquire(1, false, 0);
    EXPECT_FALSE(roles.expire(29 * kSecond));
    EXPECT_EQ(code(roles.refuses_camera(1, 29 * kSecond)), "ok");
    EXPECT_FALSE(roles.expire(58 * kSecond)) << "moving the camera renewed it";
    roles.refuses_camera(2, 58 * kSecond);
    EXPECT_EQ(code(roles.acquire(1, false, 58 * kSecond)), "ok");
    EXPECT_FALSE(roles.expire(87 * kSecond)) << "and so did acquiring it again";
    EXPECT_TRUE(roles.expire(88 * kSecond));
    EXPECT_FALSE(roles.expire(89 * kSecond)) << "told once";
    EXPECT_EQ(code(roles.refuses_camera(2, 89 * kSecond)), "ok");
    roles.acquire(1, false, 100 * kSecond);
    EXPECT_EQ(code(roles.acquire(2, false, 130 * kSecond)), "ok") << "it has ended, though nobody looked";
}

TEST_F(RolesTest, TheLeaseEndsWithTheConnection) {
    roles.acquire(1, false, 0);
    EXPECT_FALSE(roles.forget(2));
    EXPECT_TRUE(roles.forget(1));
    EXPECT_EQ(roles.holder(), 0u);
    EXPECT_FALSE(roles.forget(0));
}

// What is cut in the middle of a character is no UTF-8, and no protobuf client could read a message that holds it.
TEST_F(RolesTest, NamesAreCutBetweenCharactersAndHoldNoControls) {
    identify(7, std::string(127, 'x') + "\xC3\xA9", "controller");
    ASSERT_EQ(code(roles.acquire(7, false, 0)), "ok");
    EXPECT_EQ(roles.control().name(), std::string(127, 'x'));
    identify(8, "evil\n[critical] \x1b[31m\xff", "controller");
    ASSERT_EQ(code(roles.acquire(8, true, 0)), "ok");
    EXPECT_EQ(roles.control().name(), "evil?[critical] ?[31m?");
}

}  // namespace
}  // namespace gonio
