// SPDX-License-Identifier: Apache-2.0
// Where items of several clients wait to be served in turn, one item each: whoever has many waiting delays each other
// client by one of them at a time. Bounded for each client and for all together.
//
//   FairQueue<std::string> queue({.of_client = 2, .of_all = 3});
//   for (const auto& refused : queue.push("robot", "where is the mug?", 17)) ... refused.bound, refused.item;
//   if (const auto next = queue.pop()) ... *next->client, next->item;
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace prescene::service {

/// Each at least 1.
struct FairLimits {
  std::size_t of_client = 64;                       ///< Items of one client.
  std::size_t of_all = 256;                         ///< Items of all clients together, and ...
  std::size_t bytes_of_all = std::size_t{4} << 20;  ///< ... what they take.
};

enum class FairBound { kOfClient, kOfAll, kBytesOfAll };

/// Not thread-safe.
template <class Item>
class FairQueue {
 public:
  struct Entry {
    std::shared_ptr<const std::string> client;  ///< Never null.
    Item item;
  };
  struct Refused {
    Item item;
    FairBound bound;  ///< That it did not fit into.
  };

  explicit FairQueue(const FairLimits& limits) : limits_(limits) {}

  /// Adds an item behind the others of the client. What finds no room is given back: the item itself where the client
  /// has as many as it may, and where all together are too many, the newest of whoever has most of them (of equals, the
  /// one that comes now). Where memory ends (std::bad_alloc), the item is gone and the queue as it was.
  std::vector<Refused> push(const std::string& client, Item item, std::size_t bytes) {
    std::vector<Refused> refused;
    if (count_ >= std::min(limits_.of_client, limits_.of_all) || bytes_ + bytes > limits_.bytes_of_all)
      refused.reserve(count_ + 1);
    Waiting& own = add(client, {std::move(item), bytes});
    own.bytes += bytes;
    bytes_ += bytes;
    ++count_;
    if (own.items.size() > limits_.of_client) refused.push_back(drop_newest(own, FairBound::kOfClient));
    while (count_ > limits_.of_all)
      refused.push_back(drop_newest(most(own, [](const Waiting& one) { return one.items.size(); }), FairBound::kOfAll));
    while (bytes_ > limits_.bytes_of_all)
      refused.push_back(drop_newest(most(own, [](const Waiting& one) { return one.bytes; }), FairBound::kBytesOfAll));
    if (!refused.empty()) forget_empty();
    return refused;
  }

  /// The oldest item of the client whose turn it is: of the first for which `may_go(client, item)` holds of it. Takes
  /// no memory, so that where that has ended what waits is served all the same.
  template <class MayGo>
  std::optional<Entry> pop_if(const MayGo& may_go) {
    for (auto turn = turns_.begin(); turn != turns_.end(); ++turn) {
      const auto found = clients_.find(**turn);
      Waiting& waiting = found->second;
      if (!may_go(std::as_const(**turn), std::as_const(waiting.items.front().item))) continue;
      Entry entry{*turn, std::move(waiting.items.front().item)};
      count_ -= 1;
      bytes_ -= waiting.items.front().bytes;
      waiting.bytes -= waiting.items.front().bytes;
      waiting.items.pop_front();
      turns_.splice(turns_.end(), turns_, turn);  // behind all others
      if (waiting.items.empty()) {
        clients_.erase(found);
        turns_.pop_back();
      }
      return entry;
    }
    return std::nullopt;
  }
  std::optional<Entry> pop() {
    return pop_if([](const std::string& /*client*/, const Item& /*item*/) { return true; });
  }

  /// Takes out the items for which `matches(item)` holds; returns how many.
  template <class Matches>
  std::size_t erase_if(const Matches& matches) {
    const std::size_t before = count_;
    for (auto& [client, waiting] : clients_) {
      for (auto one = waiting.items.begin(); one != waiting.items.end();) {
        if (!matches(std::as_const(one->item))) {
          ++one;
          continue;
        }
        --count_;
        bytes_ -= one->bytes;
        waiting.bytes -= one->bytes;
        one = waiting.items.erase(one);
      }
    }
    forget_empty();
    return before - count_;
  }

  /// An item for which `matches(item)` holds; null: there is none.
  template <class Matches>
  const Item* find_if(const Matches& matches) const {
    for (const auto& [client, waiting] : clients_)
      for (const Sized& one : waiting.items)
        if (matches(one.item)) return &one.item;
    return nullptr;
  }

  std::size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }

 private:
  struct Sized {
    Item item;
    std::size_t bytes;
  };
  struct Waiting {
    std::deque<Sized> items;
    std::size_t bytes = 0;
  };

  /// All that takes memory comes before the first change, or is the change itself.
  Waiting& add(const std::string& client, Sized one) {
    if (const auto found = clients_.find(client); found != clients_.end()) {
      found->second.items.push_back(std::move(one));
      return found->second;
    }
    std::map<std::string, Waiting> fresh;
    fresh[client].items.push_back(std::move(one));
    std::list<std::shared_ptr<const std::string>> turn;
    turn.push_back(std::make_shared<const std::string>(client));
    turns_.splice(turns_.end(), turn);
    return clients_.insert(fresh.extract(fresh.begin())).position->second;
  }

  /// Else clients that are refused while nothing is taken out would add up.
  void forget_empty() {
    std::erase_if(turns_, [this](const std::shared_ptr<const std::string>& client) {
      const auto found = clients_.find(*client);
      if (!found->second.items.empty()) return false;
      clients_.erase(found);
      return true;
    });
  }

  Refused drop_newest(Waiting& of, FairBound bound) {
    Refused refused{std::move(of.items.back().item), bound};
    --count_;
    bytes_ -= of.items.back().bytes;
    of.bytes -= of.items.back().bytes;
    of.items.pop_back();
    return refused;
  }

  /// The client that has most, `own` where others have as much.
  template <class Measure>
  Waiting& most(Waiting& own, const Measure& measure) {
    Waiting* found = &own;
    for (auto& [client, waiting] : clients_)
      if (measure(waiting) > measure(*found)) found = &waiting;
    return *found;
  }

  FairLimits limits_;
  std::map<std::string, Waiting> clients_;
  std::list<std::shared_ptr<const std::string>> turns_;  // clients that have items
  std::size_t count_ = 0, bytes_ = 0;
};

}  // namespace prescene::service
