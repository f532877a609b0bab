// Where which bones may have weight, and which of them are solved for together.
#include "SkinWeightOptimizer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <queue>

namespace coronary
{
namespace
{
constexpr std::int64_t ColumnsAtOnce = 8; // fixed, so that results do not depend on the threads
constexpr double WorthFollowing = 0.85;   // of the time of an iteration
}

void SkinWeightOptimizer::ReachDomains()
{
  const std::int64_t rows = this->System.energy.rows;
  const auto bones = static_cast<std::int32_t>(this->System.bones);
  std::vector<Rows> rowsOf(bones);
  for (std::int64_t r = 0; r < rows; ++r)
  {
    rowsOf[this->System.nearest[r]].push_back(static_cast<std::int32_t>(r));
  }
  this->Domains.resize(bones);
  for (std::int32_t b = 0; b < bones; ++b)
  {
    // From the bone outwards, as long as the bones in between are short enough.
    std::vector<double> distance(bones, std::numeric_limits<double>::infinity());
    using Reached = std::pair<double, std::int32_t>;
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
    distance[b] = 0.0;
    queue.push({ 0.0, b });
    std::vector<char> done(bones, 0);
    Rows domain = std::move(this->Domains[b]);
    while (!queue.empty())
    {
      const std::int32_t bone = queue.top().second;
      queue.pop();
      if (done[bone])
      {
        continue;
      }
      done[bone] = 1;
      domain.insert(domain.end(), rowsOf[bone].begin(), rowsOf[bone].end());
      const double end = distance[bone] + (bone == b ? 0.0 : this->System.diameters[bone]);
      for (const std::int32_t next : this->System.neighbours[bone])
      {
        if (end < distance[next] && (this->Reach == 0.0 || end < this->Reach))
        {
          distance[next] = end;
          queue.push({ end, next });
        }
      }
    }
    std::sort(domain.begin(), domain.end());
    domain.erase(std::unique(domain.begin(), domain.end()), domain.end());
    this->Domains[b] = std::move(domain);
  }
}

namespace
{
/// Time of an iteration for a group, in that of one value outside of the solves.
double EffortOf(std::int64_t rows, std::size_t bones)
{
  // A pass of the factor for up to eight bones at a time, and a share of making the factor.
  const auto passes = static_cast<double>((bones + ColumnsAtOnce - 1) / ColumnsAtOnce);
  return static_cast<double>(rows) * (9.0 * passes + static_cast<double>(bones) + 2.0);
}

/// Bones put together, and about how many rows of every bone's surroundings they need.
struct Cluster
{
  std::vector<std::int32_t> bones;
  std::vector<std::pair<std::int32_t, std::int64_t>> rows; ///< (nearest bone, rows), ascending
  std::int64_t sum = 0;
  // The best one after it to be put together with.
  std::size_t partner = 0;
  double saving = 0.0;

  double Effort() const { return EffortOf(this->sum, this->bones.size()); }
};

std::vector<std::pair<std::int32_t, std::int64_t>> Together(const Cluster& a, const Cluster& b)
{
  std::vector<std::pair<std::int32_t, std::int64_t>> rows;
  auto i = a.rows.begin();
  auto j = b.rows.begin();
  while (i != a.rows.end() || j != b.rows.end())
  {
    if (j == b.rows.end() || (i != a.rows.end() && i->first < j->first))
    {
      rows.push_back(*i++);
    }
    else if (i == a.rows.end() || j->first < i->first)
    {
      rows.push_back(*j++);
    }
    else
    {
      rows.emplace_back(i->first, std::max(i->second, j->second));
      ++i;
      ++j;
    }
  }
  return rows;
}

std::int64_t SumOf(const std::vector<std::pair<std::int32_t, std::int64_t>>& rows)
{
  std::int64_t sum = 0;
  for (const auto& entry : rows)
  {
    sum += entry.second;
  }
  return sum;
}

/// Puts together what saves most, as long as that saves anything.
void Agglomerate(std::vector<Cluster>& clusters)
{
  const auto find = [&](std::size_t a)
  {
    Cluster& cluster = clusters[a];
    cluster.saving = 0.0;
    for (std::size_t b = a + 1; b < clusters.size(); ++b)
    {
      if (clusters[b].bones.empty())
      {
        continue;
      }
      const double saving = cluster.Effort() + clusters[b].Effort() -
        EffortOf(
          SumOf(Together(cluster, clusters[b])), cluster.bones.size() + clusters[b].bones.size());
      if (saving > cluster.saving)
      {
        cluster.saving = saving;
        cluster.partner = b;
      }
    }
  };
  for (std::size_t a = 0; a < clusters.size(); ++a)
  {
    find(a);
  }
  while (true)
  {
    std::size_t best = 0;
    for (std::size_t a = 1; a < clusters.size(); ++a)
    {
      best = clusters[a].saving > clusters[best].saving ? a : best;
    }
    Cluster& kept = clusters[best];
    if (!(kept.saving > 0.0))
    {
      break;
    }
    const std::size_t gone = kept.partner;
    kept.rows = Together(kept, clusters[gone]);
    kept.sum = SumOf(kept.rows);
    kept.bones.insert(kept.bones.end(), clusters[gone].bones.begin(), clusters[gone].bones.end());
    clusters[gone] = {};
    for (std::size_t a = 0; a < clusters.size(); ++a)
    {
      const bool concerned =
        a == best || clusters[a].partner == best || clusters[a].partner == gone;
      if (!clusters[a].bones.empty() && (a < best || a == best) && !concerned)
      {
        // It may suit better now than what was best.
        const double saving = clusters[a].Effort() + kept.Effort() -
          EffortOf(
            SumOf(Together(clusters[a], kept)), clusters[a].bones.size() + kept.bones.size());
        if (saving > clusters[a].saving)
        {
          clusters[a].saving = saving;
          clusters[a].partner = best;
        }
      }
      else if (!clusters[a].bones.empty() && concerned)
      {
        find(a);
      }
    }
  }
  clusters.erase(std::remove_if(clusters.begin(), clusters.end(),
                   [](const Cluster& cluster) { return cluster.bones.empty(); }),
    clusters.end());
}
}

void SkinWeightOptimizer::MakeGroups()
{
  std::vector<Cluster> clusters(this->System.bones);
  std::vector<std::int64_t> count(this->System.bones, 0);
  for (std::int64_t b = 0; b < this->System.bones; ++b)
  {
    Cluster& cluster = clusters[b];
    cluster.bones = { static_cast<std::int32_t>(b) };
    for (const std::int32_t r : this->Domains[b])
    {
      ++count[this->System.nearest[r]];
    }
    for (std::int64_t other = 0; other < this->System.bones; ++other)
    {
      if (count[other] > 0)
      {
        cluster.rows.emplace_back(static_cast<std::int32_t>(other), count[other]);
        count[other] = 0;
      }
    }
    cluster.sum = SumOf(cluster.rows);
  }
  Agglomerate(clusters);
  this->Groups.clear();
  for (Cluster& cluster : clusters)
  {
    Group group;
    group.bones = std::move(cluster.bones);
    std::sort(group.bones.begin(), group.bones.end());
    for (const std::int32_t bone : group.bones)
    {
      group.rows.insert(group.rows.end(), this->Domains[bone].begin(), this->Domains[bone].end());
    }
    std::sort(group.rows.begin(), group.rows.end());
    group.rows.erase(std::unique(group.rows.begin(), group.rows.end()), group.rows.end());
    this->Groups.push_back(std::move(group));
  }
}

void SkinWeightOptimizer::MakePairs()
{
  const std::int64_t rows = this->System.energy.rows;
  this->Tasks.clear();
  this->Size = 0;
  for (std::size_t g = 0; g < this->Groups.size(); ++g)
  {
    Group& group = this->Groups[g];
    group.base = this->Size;
    const auto columns = static_cast<std::int64_t>(group.bones.size());
    this->Size += columns * static_cast<std::int64_t>(group.rows.size());
    for (std::int64_t first = 0; first < columns; first += ColumnsAtOnce)
    {
      this->Tasks.push_back({ g, first, std::min(ColumnsAtOnce, columns - first) });
    }
  }
  // The longest first, so that threads end together.
  std::stable_sort(this->Tasks.begin(), this->Tasks.end(),
    [&](const Task& a, const Task& c)
    { return this->Groups[a.group].rows.size() > this->Groups[c.group].rows.size(); });
  this->PairOffset.assign(rows + 1, 0);
  for (const Group& group : this->Groups)
  {
    for (const std::int32_t r : group.rows)
    {
      this->PairOffset[r + 1] += static_cast<std::int64_t>(group.bones.size());
    }
  }
  std::partial_sum(this->PairOffset.begin(), this->PairOffset.end(), this->PairOffset.begin());
  this->PairBone.resize(this->Size);
  this->PairIndex.resize(this->Size);
  this->RowOfValue.resize(this->Size);
  this->Linear.assign(this->Size, 0.0);
  std::vector<std::int64_t> next(this->PairOffset.begin(), this->PairOffset.end() - 1);
  // Bones ascending in every row.
  std::vector<std::pair<const Group*, std::size_t>> place(this->System.bones);
  for (const Group& group : this->Groups)
  {
    for (std::size_t k = 0; k < group.bones.size(); ++k)
    {
      place[group.bones[k]] = { &group, k };
    }
  }
  for (std::int64_t bone = 0; bone < this->System.bones; ++bone)
  {
    const auto& [group, k] = place[bone];
    const auto height = static_cast<std::int64_t>(group->rows.size());
    const std::int64_t base = group->base + static_cast<std::int64_t>(k) * height;
    auto entry = this->System.linear[bone].begin();
    const auto end = this->System.linear[bone].end();
    for (std::int64_t i = 0; i < height; ++i)
    {
      const std::int32_t r = group->rows[i];
      this->PairBone[next[r]] = static_cast<std::int32_t>(bone);
      this->PairIndex[next[r]] = base + i;
      ++next[r];
      this->RowOfValue[base + i] = r;
      while (entry != end && entry->row < r)
      {
        ++entry;
      }
      if (entry != end && entry->row == r)
      {
        this->Linear[base + i] = entry->value;
      }
    }
  }
}

bool SkinWeightOptimizer::CanWiden() const
{
  return this->Reach > 0.0 &&
    std::any_of(this->Groups.begin(), this->Groups.end(),
      [&](const Group& group)
      { return static_cast<std::int64_t>(group.rows.size()) < this->System.energy.rows; });
}

void SkinWeightOptimizer::Rearrange(
  const std::function<void()>& change, const std::vector<Values*>& values)
{
  const std::vector<std::int64_t> offset = this->PairOffset;
  const std::vector<std::int32_t> bone = this->PairBone;
  const std::vector<std::int64_t> index = this->PairIndex;
  change();
  std::vector<Values> old;
  for (Values* const v : values)
  {
    old.push_back(std::move(*v));
    v->assign(this->Size, 0.0);
  }
  for (std::int64_t r = 0; r < this->System.energy.rows; ++r)
  {
    std::int64_t o = offset[r];
    for (std::int64_t p = this->PairOffset[r]; p < this->PairOffset[r + 1]; ++p)
    {
      while (o < offset[r + 1] && bone[o] < this->PairBone[p])
      {
        ++o;
      }
      for (std::size_t k = 0; o < offset[r + 1] && bone[o] == this->PairBone[p] && k < old.size();
           ++k)
      {
        (*values[k])[this->PairIndex[p]] = old[k][index[o]];
      }
    }
  }
}

void SkinWeightOptimizer::Widen()
{
  this->Rearrange(
    [&]
    {
      this->Reach += 1.0;
      this->ReachDomains();
      this->MakeGroups();
      this->MakePairs();
    },
    { &this->Weights });
}

double SkinWeightOptimizer::Effort() const
{
  double effort = 0.0;
  for (const Group& group : this->Groups)
  {
    effort += EffortOf(static_cast<std::int64_t>(group.rows.size()), group.bones.size());
  }
  return effort;
}

std::vector<SkinWeightOptimizer::Rows> SkinWeightOptimizer::Support(
  const Values& z, const std::vector<Violator>& violators, int rings) const
{
  const SparseMatrix& q = this->System.energy;
  std::vector<Rows> support(this->System.bones);
  for (const Violator& violator : violators)
  {
    support[violator.bone].push_back(violator.row);
  }
  for (const Group& group : this->Groups)
  {
    const auto height = static_cast<std::int64_t>(group.rows.size());
    for (std::size_t k = 0; k < group.bones.size(); ++k)
    {
      const double* w = z.data() + group.base + static_cast<std::int64_t>(k) * height;
      for (std::int64_t i = 0; i < height; ++i)
      {
        if (w[i] > 0.0)
        {
          support[group.bones[k]].push_back(group.rows[i]);
        }
      }
    }
  }
  ParallelFor(this->System.bones, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<char> marked(q.rows, 0);
      for (std::int64_t b = first; b < last; ++b)
      {
        Rows all;
        const auto add = [&](std::int32_t row)
        {
          if (!marked[row])
          {
            marked[row] = 1;
            all.push_back(row);
          }
        };
        std::for_each(support[b].begin(), support[b].end(), add);
        std::size_t begin = 0;
        for (int ring = 0; ring < rings; ++ring)
        {
          const std::size_t end = all.size();
          for (; begin < end; ++begin)
          {
            const std::int32_t row = all[begin];
            std::for_each(
              q.column.begin() + q.offset[row], q.column.begin() + q.offset[row + 1], add);
          }
        }
        for (const std::int32_t row : all)
        {
          marked[row] = 0;
        }
        std::sort(all.begin(), all.end());
        support[b] = std::move(all);
      }
    });
  return support;
}

bool SkinWeightOptimizer::Follow(
  const Values& z, const std::vector<Violator>& violators, bool needed, Values& s, Values& x)
{
  std::vector<Rows> domains = this->Support(z, violators, 2);
  const auto positive = std::count_if(z.begin(), z.end(), [](double w) { return w > 0.0; });
  needed = needed || 100 * violators.size() > static_cast<std::size_t>(positive);
  const double before = this->Effort();
  std::vector<Group> groups = std::move(this->Groups);
  std::swap(this->Domains, domains);
  this->MakeGroups();
  if (!needed && this->Effort() > WorthFollowing * before)
  {
    std::swap(this->Domains, domains);
    this->Groups = std::move(groups);
    return false;
  }
  this->Rearrange([&] { this->MakePairs(); }, { &s, &x });
  this->Follows = true;
  return true;
}

bool SkinWeightOptimizer::Grow(
  const Values& z, const std::vector<Violator>& violators, Values& s, Values& x)
{
  const std::vector<Rows> support = this->Support(z, violators, 1);
  const auto add = [](const Rows& from, Rows& to)
  {
    Rows both;
    both.reserve(to.size());
    std::set_union(from.begin(), from.end(), to.begin(), to.end(), std::back_inserter(both));
    to = std::move(both);
  };
  this->Rearrange(
    [&]
    {
      for (Group& group : this->Groups)
      {
        const std::size_t before = group.rows.size();
        for (const std::int32_t bone : group.bones)
        {
          add(support[bone], this->Domains[bone]);
          add(support[bone], group.rows);
        }
        if (group.rows.size() != before)
        {
          group.factor.reset();
        }
      }
      this->MakePairs();
    },
    { &s, &x });
  return true;
}
}
