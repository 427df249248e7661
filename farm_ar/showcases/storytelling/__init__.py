"""AR storytelling: virtual characters on real chairs (paper, section 4.3.2)."""

from farm_ar.showcases.storytelling.film import film_story
from farm_ar.showcases.storytelling.story import METHODS, Seat, Story, seats_of
from farm_ar.showcases.storytelling.trials import show_stories, story_of, tell

__all__ = ["METHODS", "Seat", "Story", "film_story", "seats_of", "show_stories", "story_of", "tell"]
