"""Control of an antagonistic joint, judged and tuned over every posterior draw."""
